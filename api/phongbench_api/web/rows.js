// The rows of a run's table: filtered, sorted and cut into pages by the service, shown here. The address keeps the question.

import { get, newest } from './api.js';
import { $, make, tell } from './dom.js';
import { number } from './format.js';

const [, run] = location.pathname.match(/^\/runs\/([^/]+)\/rows$/) ?? [];
const home = `/v1/runs/${run}`;
/** As many as the service gives at once. */
const MOST = 50000;
const PLAIN = ['table', 'sort', 'limit', 'columns'];

/** What is known of the table: its columns, by name, and how many rows it has. */
let about = { columns: [], rows: 0 };
/** What is asked: the table, filters by column, order, the columns that are shown, rows a page. */
let asked = fromHash();
/** Cursors of the pages turned over so far; the last is that of the page shown. */
let cursors = [null];
let following = null;

function fromHash() {
  const given = new URLSearchParams(location.hash.slice(1));
  const filters = Object.create(null);
  for (const [name, value] of given) if (!PLAIN.includes(name)) (filters[name] ??= []).push(value);
  const columns = given.get('columns');
  return { table: given.get('table') ?? 'accuracy', sort: given.get('sort') ?? '', limit: given.get('limit') ?? '25', columns: columns ? columns.split(',') : null, filters };
}

/** The question as pairs of a query. @param {boolean} whole with what only this page needs to know */
function pairs(whole = false) {
  const { table, sort, limit, columns, filters } = asked;
  const own = whole ? [['table', table], ['limit', limit]] : [];
  const more = [['sort', sort], ['columns', (whole ? columns : shown())?.join(',')]].filter(([, value]) => value);
  return [...own, ...more, ...Object.entries(filters).flatMap(([name, values]) => values.map((value) => [name, value]))];
}
const query = (entries) => new URLSearchParams(entries).toString().replaceAll('%2C', ',');

/** A value as filters have it, and as it is written. */
const word = (value) => (value === null ? 'none' : String(value));
const written = (value) => (typeof value === 'number' ? number(value, 4) : value === null ? '–' : String(value));

/** Columns that are shown: those chosen, else all that do not have one value throughout, or by their filter. */
const same = ({ name, values }) => values?.length === 1 || asked.filters[name]?.length === 1;
const shown = () => asked.columns ?? about.columns.filter((column) => !same(column)).map((column) => column.name);

/** Changes the question; a page of another question is the first. */
function set(patch) {
  asked = { ...asked, ...patch };
  cursors = [null];
  history.replaceState(null, '', `#${query(pairs(true))}`);
  ask();
}

const busy = (is) => $('main').setAttribute('aria-busy', String(is));
const ask = newest(async (signal) => {
  try {
    const cursor = cursors.at(-1);
    const page = await get(`${home}/${asked.table}?${query([...pairs(), ['limit', asked.limit], ...(cursor ? [['cursor', cursor]] : [])])}`, {}, signal);
    following = page.next;
    tell($('problem'), null);
    show(page);
  } catch (problem) {
    if (problem.name === 'AbortError') throw problem;
    tell($('problem'), problem, ask);
    $('rows').replaceChildren();
    $('count').textContent = '';
  }
}, busy);

function show({ rows, total }) {
  const columns = shown().map((name) => about.columns.find((column) => column.name === name)).filter(Boolean);
  const kind = (column) => (column.kind === 'text' || column.kind === 'flag' ? { class: 'text' } : {});
  $('rows').replaceChildren(make('table', {}, make('caption', { class: 'unseen' }, `Rows of ${asked.table}`),
    make('thead', {}, make('tr', {}, ...columns.map((column) => head(column, kind(column))))),
    make('tbody', {}, ...rows.map((row) => make('tr', {}, ...columns.map((column) => make('td', { ...kind(column), title: word(row[column.name]) }, written(row[column.name]))))))));
  const from = asked.limit * (cursors.length - 1);
  $('count').textContent = `${total.toLocaleString('en')} of ${about.rows.toLocaleString('en')} rows`;
  $('page').textContent = rows.length ? `${(from + 1).toLocaleString('en')} to ${(from + rows.length).toLocaleString('en')}` : 'none fits';
  $('first').disabled = $('previous').disabled = cursors.length === 1;
  $('next').disabled = following === null;
  for (const format of ['csv', 'parquet']) {
    const link = $(format);
    link.href = `${home}/${asked.table}?${query([...pairs(), ['limit', MOST], ['format', format]])}`;
    link.download = `${run}-${asked.table}.${format}`;
    link.title = total > MOST ? `the first ${MOST.toLocaleString('en')} rows` : '';
  }
}

/** A column's head: a button that sorts by it, upwards, downwards, and no more. */
function head(column, more) {
  const { name, unit, meaning } = column;
  const order = { [name]: 'ascending', [`-${name}`]: 'descending' }[asked.sort];
  const next = { ascending: `-${name}`, descending: '' }[order] ?? name;
  const sign = { ascending: ' ↑', descending: ' ↓' }[order] ?? '';
  const button = make('button', { type: 'button', title: unit && unit !== '1' ? `${meaning}, in ${unit}` : meaning, onclick: () => set({ sort: next }) }, name + sign);
  return make('th', { scope: 'col', 'aria-sort': order, ...more }, button);
}

/** A closed list of boxes. @param {string} name @param {[string, string][]} offered value and label @param {() => string[]} chosen @param {(values: string[]) => void} choose @param {() => string} said what is chosen, in words; '' for nothing */
function boxes(name, offered, chosen, choose, said, usual) {
  const summary = make('summary', {});
  const list = make('fieldset', {}, make('legend', { class: 'unseen' }, name), ...offered.map(([value, label]) => make('label', {},
    make('input', { type: 'checkbox', value, checked: chosen().includes(value), onchange: () => { choose([...list.querySelectorAll('input:checked')].map((box) => box.value)); told(); } }), label)));
  const details = make('details', { class: 'filter', name: 'filter' }, summary, list);
  const told = () => { summary.textContent = `${name}: ${said() || usual}`; details.classList.toggle('set', said() !== ''); };
  told();
  return details;
}

function showFilters() {
  const offered = about.columns.filter((column) => column.filter && column.values?.length > 1);
  const choose = (name) => (values) => { const { [name]: old, ...rest } = asked.filters; set({ filters: values.length ? { ...rest, [name]: values } : rest }); };
  $('filters').replaceChildren(...offered.map(({ name, values }) => boxes(name, values.map((value) => [word(value), written(value)]), () => asked.filters[name] ?? [], choose(name), () => (asked.filters[name] ?? []).join(', '), 'any')),
    boxes('columns', about.columns.map(({ name }) => [name, name]), shown, (columns) => set({ columns: columns.length ? columns : null }), () => (asked.columns ? `${asked.columns.length} of ${about.columns.length}` : ''), 'those that vary'));
  const alike = about.columns.filter(({ values }) => values?.length === 1).map(({ name, values: [value] }) => `${name} ${written(value)}`);
  $('constant').textContent = alike.length ? `The same in every row: ${alike.join(', ')}.` : '';
}

/** Reads what the table has, then its rows. */
async function open() {
  busy(true);
  try {
    about = await get(`${home}/columns`, { table: asked.table });
    $('meaning').textContent = `${about.meaning}.`;
    $('dictionary').href = `/guide/columns.md#${asked.table}`;
    $('limit').value = asked.limit;
    showFilters();
    ask();
  } catch (problem) {
    tell($('problem'), problem, open);
    busy(false);
  }
}

async function start() {
  try {
    const manifest = await get(home);
    document.title = `Rows of run ${manifest.id} - phongbench`;
    $('title').textContent = `Run ${manifest.id}`;
    $('report-link').hidden = !manifest.report;
    $('report-link').href = `/runs/${run}/report/`;
    const tables = Object.keys(manifest.files ?? {}).filter((name) => name.endsWith('.parquet')).map((name) => name.slice(0, -8));
    $('table').replaceChildren(...tables.map((name) => make('option', { value: name }, name)));
    if (!tables.includes(asked.table)) asked.table = tables[0];
    $('table').value = asked.table;
    await open();
  } catch (problem) {
    tell($('problem'), problem, start);
    busy(false);
  }
}

$('table').addEventListener('change', ({ target }) => { asked = { ...asked, table: target.value, sort: '', columns: null, filters: {} }; cursors = [null]; history.replaceState(null, '', `#${query(pairs(true))}`); open(); });
$('limit').addEventListener('change', ({ target }) => set({ limit: target.value }));
$('next').addEventListener('click', () => { cursors.push(following); ask(); });
$('previous').addEventListener('click', () => { cursors.pop(); ask(); });
$('first').addEventListener('click', () => { cursors = [null]; ask(); });
/** Closes the lists that are open, but for one. @param {Element|null} kept */
const fold = (kept) => { for (const details of document.querySelectorAll('.filter[open]')) if (details !== kept) details.open = false; };
addEventListener('click', ({ target }) => fold(target.closest('.filter')));
addEventListener('keydown', ({ key, target }) => {
  if (key !== 'Escape') return;
  target.closest('.filter')?.querySelector('summary').focus();
  fold(null);
});
$('filters').addEventListener('submit', (event) => event.preventDefault());
addEventListener('hashchange', () => { const before = asked.table; asked = fromHash(); cursors = [null]; if (asked.table === before) { showFilters(); ask(); } else start(); });
start();

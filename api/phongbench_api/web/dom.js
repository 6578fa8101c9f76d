// Small helpers for the document. Text is always set as text: a run's name is never markup.

/** @param {string} id @returns {any} */
export const $ = (id) => document.getElementById(id);

/**
 * An element with attributes and children; `on...` attributes are listeners.
 * @param {string} tag @param {Record<string, any>} [attributes] @param {...(Node|string)} children
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, '');
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(key, value);
  }
  element.append(...children);
  return element;
}

/**
 * Fills a place with radio buttons; does nothing if it has the same ones already, so focus stays.
 * @param {HTMLElement} place @param {string} name @param {[string, string, string?][]} offered value, label, explanation
 * @param {string} chosen @param {(value: string) => void} choose
 */
export function choices(place, name, offered, chosen, choose) {
  const key = offered.map(([value]) => value).join();
  if (place.dataset.offered !== key) {
    place.dataset.offered = key;
    place.replaceChildren(...offered.map(([value, label, title]) => make('label', { title },
      make('input', { type: 'radio', name, value, onchange: () => choose(value) }), make('span', {}, label))));
  }
  for (const input of place.querySelectorAll('input')) input.checked = input.value === chosen;
}

/** A table. @param {string[]} heads @param {(Node|string)[][]} rows @param {string} caption */
export function table(heads, rows, caption) {
  const line = (tag, cells, more = {}) => make('tr', {}, ...cells.map((cell) => make(tag, more, cell)));
  return make('table', {}, make('caption', { class: 'unseen' }, caption),
    make('thead', {}, line('th', heads, { scope: 'col' })), make('tbody', {}, ...rows.map((cells) => line('td', cells))));
}

/** Shows a problem in a place, or hides the place. @param {HTMLElement} place @param {any} problem @param {(() => void)|null} [again] */
export function tell(place, problem, again = null) {
  place.hidden = !problem;
  if (!problem) return place.replaceChildren();
  const retry = again && problem.status === 0 ? [' ', make('button', { type: 'button', onclick: again }, 'Try again')] : [];
  return place.replaceChildren(make('b', {}, `${problem.title.replace(/[.:]$/, '')}:`), ' ', problem.detail ?? problem.message, ...retry);
}

/** A filler of a details' region: at once where it is open, else when it is opened. @param {HTMLDetailsElement} details */
export function lazily(details) {
  const region = details.querySelector('.scroll');
  let fill = () => [];
  const show = () => { if (details.open) region.replaceChildren(...[fill()].flat()); };
  details.addEventListener('toggle', show);
  return (filler) => { fill = filler; show(); };
}

/** The value of a colour of the style sheet. @param {string} name */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// Numbers as people read them: one way to write each.

const SUPERSCRIPT = { '-': '⁻', 0: '⁰', 1: '¹', 2: '²', 3: '³', 4: '⁴', 5: '⁵', 6: '⁶', 7: '⁷', 8: '⁸', 9: '⁹' };
const raised = (exponent) => [...String(exponent)].map((sign) => SUPERSCRIPT[sign]).join('');

/** Three significant digits: 0.0299, 1.7×10⁻⁵, "not finite". @param {number|null} value @returns {string} */
export function number(value, digits = 3) {
  if (value === null || value === undefined) return '–';
  if (!Number.isFinite(value)) return 'not finite';
  if (value === 0) return '0';
  const size = Math.abs(value);
  const sign = value < 0 ? '−' : '';
  if (size < 1e-3 || size >= 1e6) {
    const [mantissa, exponent] = size.toExponential(digits - 1).split('e');
    return `${sign}${trimmed(mantissa)}×10${raised(Number(exponent))}`;
  }
  return sign + (size >= 10 ** digits ? size.toFixed(0) : trimmed(size.toPrecision(digits)));
}

/** The digits of a number without zeros at the end of its fraction. @param {string} text */
const trimmed = (text) => (text.includes('.') ? text.replace(/\.?0+$/, '') : text);

/** @param {number} value */
export const degrees = (value) => `${number(value)}°`;

/** Errors as 8-bit codes: "10.7 codes". @param {number} error */
export function codes(error) {
  const count = 255 * error;
  return `${number(count)} ${Math.abs(count) === 1 ? 'code' : 'codes'}`;
}

/** A signed fraction: "+1 %", "−0.0175 %", "0 %". @param {number} value */
export function percent(value) {
  return `${value > 0 ? '+' : ''}${number(100 * value)}\u00a0%`;
}

/** The label of a decade on a log axis; empty between decades. @param {number} value */
export function decade(value) {
  const exponent = Math.round(Math.log10(value));
  if (!(value > 0) || Math.abs(value / 10 ** exponent - 1) > 1e-6) return '';
  return exponent >= -3 && exponent <= 3 ? String(Number((10 ** exponent).toPrecision(1))) : `10${raised(exponent)}`;
}

/** A number as the service reads it: shortest form, no thousands, no rounding beyond six digits. @param {number} value */
export const plain = (value) => String(Number(value.toPrecision(6)));

/**
 * A formula as commands and addresses spell it: lyon:cross:8:minimax. What is the approximation's only or first is left out.
 * @param {Record<string, any>} formula @param {any} spec its entry in the registry
 */
export function spelling(formula, spec) {
  const parts = [formula.approximation];
  if (spec.lambda_forms.length > 1) parts.push(formula.lambda);
  if (formula.gamma !== null) parts.push(formula.gamma);
  if (formula.beta !== spec.beta_policies[0]) parts.push(formula.beta);
  const space = formula.space === spec.spaces[0] ? '' : formula.space === 'half' ? '@half' : '@pair';
  return parts.join(':') + space + ((formula.normalise ?? 'none') === 'none' ? '' : `/${formula.normalise}`);
}

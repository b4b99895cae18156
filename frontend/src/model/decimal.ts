/** Exact arithmetic of scales and typed numbers: a fraction of two big integers. No rounding may change a raw value. */

export interface Fraction {
  num: bigint;
  den: bigint;
}

const PLAIN = /^([-+]?)(\d+)(?:[.,](\d+))?(?:e([-+]?\d+))?$/i;

/** Reads `49.5`, `49,5`, `-3` or `1e-7` exactly; null for anything else. */
export function fraction(text: string): Fraction | null {
  const match = PLAIN.exec(text.trim());
  if (!match) return null;
  const decimals = match[3] ?? "";
  const exponent = Number(match[4] ?? 0) - decimals.length;
  const digits = BigInt(`${match[2] ?? "0"}${decimals}`) * (match[1] === "-" ? -1n : 1n);
  return exponent >= 0
    ? { num: digits * 10n ** BigInt(exponent), den: 1n }
    : { num: digits, den: 10n ** BigInt(-exponent) };
}

/** The fraction of a finite number as its shortest decimal text says it: 0.1 is one tenth. */
export function fractionOf(number: number): Fraction {
  const exact = fraction(String(number));
  if (!exact) throw new RangeError(`${number} is not finite`);
  return exact;
}

export const times = (a: Fraction, b: Fraction): Fraction => positive(a.num * b.num, a.den * b.den);
export const divide = (a: Fraction, b: Fraction): Fraction => positive(a.num * b.den, a.den * b.num);
export const toNumber = (a: Fraction): number => Number(a.num) / Number(a.den);

/** The integer it is, or null where it lies between two. */
export function wholeOf(a: Fraction): bigint | null {
  return a.num % a.den === 0n ? a.num / a.den : null;
}

/** Text with exactly `decimals` decimals, rounded half away from zero. */
export function toFixed(a: Fraction, decimals: number): string {
  const shift = 10n ** BigInt(decimals);
  const negative = a.num < 0n;
  const size = negative ? -a.num : a.num;
  const rounded = (size * shift * 2n + a.den) / (a.den * 2n);
  const digits = rounded.toString().padStart(decimals + 1, "0");
  const text = decimals === 0 ? digits : `${digits.slice(0, -decimals)}.${digits.slice(-decimals)}`;
  return negative && rounded !== 0n ? `-${text}` : text;
}

function positive(num: bigint, den: bigint): Fraction {
  return den < 0n ? { num: -num, den: -den } : { num, den };
}

/** Named bits of a mask. Works on numbers up to 53 bits without the 32-bit traps of the shift operators. */
import type { BitDoc, EntryDoc } from "../api/types";

const patternOf = (entry: EntryDoc, raw: number): bigint =>
  BigInt.asUintN(Math.max(8, entry.bit_count ?? 8), BigInt(raw));

const maskOf = (bit: BitDoc): bigint => ((1n << BigInt(bit.last - bit.bit + 1)) - 1n) << BigInt(bit.bit);

/** Value of the bit, or of the field of bits. */
export function fieldOf(entry: EntryDoc, raw: number, bit: BitDoc): number {
  return Number((patternOf(entry, raw) & maskOf(bit)) >> BigInt(bit.bit));
}

/** Largest value the field can hold: 1 for a single bit. */
export function fieldMax(bit: BitDoc): number {
  return Number(maskOf(bit) >> BigInt(bit.bit));
}

/** The raw value with the bit, or field, set to `value`; every other bit stays, reserved ones included. */
export function withField(entry: EntryDoc, raw: number, bit: BitDoc, value: number): number {
  const mask = maskOf(bit);
  const pattern = (patternOf(entry, raw) & ~mask) | ((BigInt(value) << BigInt(bit.bit)) & mask);
  const width = entry.bit_count ?? 8;
  const signed = (entry.range?.[0] ?? 0) < 0;
  return Number(signed ? BigInt.asIntN(width, pattern) : BigInt.asUintN(Math.max(8, width), pattern));
}

/** The named bits that are set. */
export function setBits(entry: EntryDoc, raw: number, table: readonly BitDoc[]): BitDoc[] {
  return table.filter((bit) => fieldOf(entry, raw, bit) !== 0);
}

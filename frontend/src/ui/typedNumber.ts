/** What a number field holds: while "90.00" or "5." is typed it gives the text, and that is a number all the same. */
export function typedNumber(value: number | string, take: (number: number) => void): void {
  const number = typeof value === "number" ? value : value.trim() === "" ? NaN : Number(value);
  if (Number.isFinite(number)) take(number);
}

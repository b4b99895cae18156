/** Tables as text: tabs for the clipboard, CSV (RFC 4180) for files. */

export type TextTable = readonly (readonly string[])[];

export function tsvOf(lines: TextTable): string {
  return lines.map((line) => line.map((cell) => cell.replaceAll(/[\t\r\n]+/g, " ")).join("\t")).join("\n");
}

export function csvOf(lines: TextTable): string {
  return lines.map((line) => `${line.map(quoted).join(",")}\r\n`).join("");
}

function quoted(cell: string): string {
  // A spreadsheet would take these for formulas.
  const safe = /^[=@]/.test(cell) ? `'${cell}` : cell;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}

const BOM = "\uFEFF";

export function download(name: string, text: string): void {
  downloadBlob(name, new Blob([BOM, text], { type: "text/csv;charset=utf-8" }));
}

export function downloadBlob(name: string, blob: Blob): void {
  const url = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  URL.revokeObjectURL(url);
}

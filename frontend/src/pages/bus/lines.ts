/** Rows of the trace in words: what stands in the table, in the detail and in the file. */
import type { TraceItem, TraceLine } from "../../api/trace";
import { localise } from "../../model/values";
import type { Translate } from "../../texts/texts";
import { timeOfDay } from "../../ui/format";

const NUMBER = /^-?\d+\.\d+$/;

type Identified = Pick<TraceLine, "can_id" | "extended"> & Partial<Pick<TraceLine, "transaction" | "fdl">>;

/** The identifier in hexadecimal; of an ADU the number of its transaction; of a telegram its addresses. */
export function idText(line: Identified): string {
  if (typeof line.transaction === "number") return `#${String(line.transaction)}`;
  if (line.fdl) return `${station(line.fdl.source)}→${station(line.fdl.destination)}`;
  return line.can_id
    .toString(16)
    .toUpperCase()
    .padStart(line.extended ? 8 : 3, "0");
}

export const station = (address: number | null): string => (address === null ? "–" : String(address));

/** Neither an ADU of Modbus TCP nor a telegram of PROFIBUS. */
export const isCan = (line: Pick<TraceLine, "transaction" | "fdl">): boolean =>
  line.transaction === null && line.fdl === null;

export const bytesOf = (hex: string): string[] => hex.toUpperCase().match(/../g) ?? [];

/** Bytes of the MBAP header, which transaction, unit and length of the row tell as well. */
export const HEADER_BYTES = 7;

/** Bytes before the data of a telegram of PROFIBUS, by its start delimiter: up to the function code. */
const FDL_HEADS: Readonly<Record<string, number>> = { "68": 7, A2: 4 };
const FDL_TAIL = 2;

/** What a row shows of the bytes: of an ADU those behind its header, of a telegram its data where it has some. */
export function shownBytes(line: Pick<TraceLine, "data" | "transaction" | "fdl">): string[] {
  const bytes = bytesOf(line.data);
  if (line.transaction !== null) return bytes.slice(HEADER_BYTES);
  const head = line.fdl?.sound ? FDL_HEADS[bytes[0] ?? ""] : undefined;
  return head === undefined ? bytes : bytes.slice(head, -FDL_TAIL);
}

/** `TPDO2`, `SDO req`, `Heartbeat`, `FC 43 req`. */
export function serviceText(line: Pick<TraceLine, "service" | "number">, t: Translate): string {
  const name = t(`trace.service.${line.service}`, { number: line.number });
  return !line.service.startsWith("modbus-") && line.number > 0 ? `${name}${String(line.number)}` : name;
}

export function objectName(item: TraceItem, t: Translate): string {
  if (item.name === null) return "";
  const name = t.nameOf(item.name);
  return item.sub === null ? name : `${name}: ${t.nameOf(item.sub)}`;
}

/** `49.0 °C`, `0637h`, `Profile position (1)`; empty where the row only names the object. */
export function valueText(item: TraceItem, t: Translate): string {
  if (item.text === null) return "";
  if (item.key !== null) return `${t(item.key)} (${item.text})`;
  const text = NUMBER.test(item.text) ? localise(item.text, t.language) : item.text;
  return item.unit === "" ? text : `${text} ${item.unit}`;
}

export function noteTexts(line: TraceLine, t: Translate): string[] {
  return line.notes.map((note) => t(note.key, localised(note.details, t)));
}

function localised(details: TraceLine["notes"][number]["details"], t: Translate): Record<string, unknown> {
  const shown = ([name, detail]: [string, unknown]): [string, unknown] => [
    name,
    typeof detail === "string" && NUMBER.test(detail) ? localise(detail, t.language) : detail,
  ];
  return Object.fromEntries(Object.entries(details).map(shown));
}

/** `14:03:22.118734`: to the microsecond. */
export function exactTime(tNs: number): string {
  const micros = (BigInt(tNs) / 1000n) % 1000n;
  return `${timeOfDay(tNs / 1e6)}${micros.toString().padStart(3, "0")}`;
}

/** All that a row means, as one text. */
export function meaningText(line: TraceLine, t: Translate): string {
  const step = line.step === null ? [] : [t(`trace.step.${line.step}`)];
  const items = line.items.map((item) =>
    [item.address, objectName(item, t), item.text === null ? "" : `= ${valueText(item, t)}`]
      .filter(Boolean)
      .join(" "),
  );
  return [...step, ...items, ...noteTexts(line, t)].join(" · ");
}

/** The row of the request, or of the answer, with which this one makes a transfer. */
export function partnerOf(line: TraceLine, rows: readonly TraceLine[]): TraceLine | undefined {
  if (line.start_t_ns !== null && line.start_t_ns !== line.t_ns)
    return rows.find((row) => row.t_ns === line.start_t_ns && row.bus === line.bus);
  return rows.find(
    (row) => row.start_t_ns === line.t_ns && row.bus === line.bus && row.node === line.node && row !== line,
  );
}

export function table(rows: readonly TraceLine[], t: Translate): string[][] {
  const heads = ["time", "direction", "id", "node", "service", "data", "meaning"];
  return [
    ["t_ns", ...heads.map((head) => t(`trace.column.${head}`))],
    ...rows.map((row) => [
      BigInt(row.t_ns).toString(),
      timeOfDay(row.t_ns / 1e6),
      row.direction,
      idText(row),
      row.node === 0 ? "" : String(row.node),
      serviceText(row, t),
      bytesOf(row.data).join(" "),
      meaningText(row, t),
    ]),
  ];
}

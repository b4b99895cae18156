/** The parts of a PROFIBUS telegram, byte by byte, as its data link layer orders them (IEC 61158 type 3). */
import type { TraceLine } from "../../api/trace";
import { bytesOf } from "./lines";

/** `head` is the frame around the data, by the names of the standard; `data` is named by a text of its own. */
export interface Part {
  name: string;
  kind: "head" | "data";
  bytes: string[];
}

const SD2 = "68";
/** Names of the bytes of telegrams that always have the same, by their start delimiter. */
const PLAIN: Readonly<Record<string, readonly string[]>> = {
  "10": ["SD1", "DA", "SA", "FC", "FCS", "ED"],
  DC: ["SD4", "DA", "SA"],
  E5: ["SC"],
};
const HEADS: Readonly<Record<string, readonly string[]>> = {
  [SD2]: ["SD2", "LE", "LEr", "SD2", "DA", "SA", "FC"],
  A2: ["SD3", "DA", "SA", "FC"],
};
const TAIL = ["FCS", "ED"];
const PKW_BYTES = 8;

type Shown = Pick<TraceLine, "data" | "step" | "fdl">;

/** What no telegram is, is one part. */
export function partsOf(line: Shown): Part[] {
  const bytes = bytesOf(line.data);
  const start = bytes[0] ?? "";
  const plain = PLAIN[start];
  const head = HEADS[start];
  if (!line.fdl?.sound || (plain ?? head) === undefined) return [{ name: "broken", kind: "data", bytes }];
  if (plain !== undefined) return named(plain, bytes);
  const names = [...(head ?? []), ...points(line.fdl)];
  const data = bytes.slice(names.length, -TAIL.length);
  return [...named(names, bytes), ...content(line, data), ...named(TAIL, bytes.slice(-TAIL.length))];
}

const named = (names: readonly string[], bytes: string[]): Part[] =>
  names.map((name, at) => ({ name, kind: "head", bytes: bytes.slice(at, at + 1) }));

const points = (fdl: NonNullable<TraceLine["fdl"]>): string[] => [
  ...(fdl.dsap === null ? [] : ["DSAP"]),
  ...(fdl.ssap === null ? [] : ["SSAP"]),
];

function content(line: Shown, data: string[]): Part[] {
  const size = line.fdl?.pkw ? PKW_BYTES : 0;
  const rest = line.step === "data-exchange" ? "pzd" : "data";
  const parts: Part[] = [
    { name: "pkw", kind: "data", bytes: data.slice(0, size) },
    { name: rest, kind: "data", bytes: data.slice(size) },
  ];
  return parts.filter((part) => part.bytes.length > 0);
}

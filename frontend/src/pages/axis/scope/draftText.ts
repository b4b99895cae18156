/**
 * What the scope waits for as a link tells it: the kind, then what is not the usual, with devices and signals without
 * their turbine: `edge;signal:blade-1/pmc/6064;level:45;slope:falling;total:4;pre:1`.
 */
import { type Draft, FIRST } from "./draft";

const KINDS = ["manual", "edge", "level", "event", "fault"] as const;
const CHOICES = {
  slope: ["rising", "falling", "either"],
  side: ["above", "below"],
  event: ["emcy", "boot_up", "nmt", "axis_state", "bit"],
  mode: ["single", "normal", "auto"],
} as const;
const NUMBERS = {
  level: "level",
  total: "totalS",
  pre: "preS",
  holdoff: "holdOffS",
  auto: "autoS",
} as const;
const PLACES = ["signal", "device"] as const;

type Choice = keyof typeof CHOICES;
const names = <K extends string>(table: Record<K, unknown>) => Object.keys(table) as K[];

export function draftText(draft: Draft): string {
  const parts: string[] = [draft.kind];
  const put = (name: string, value: string | number | null, usual: string | number | null) => {
    if (value !== usual && value !== null) parts.push(`${name}:${value}`);
  };
  for (const name of PLACES) put(name, withoutTurbine(draft[name]), FIRST[name]);
  for (const name of names(NUMBERS)) put(name, draft[NUMBERS[name]], FIRST[NUMBERS[name]]);
  for (const name of names(CHOICES)) put(name, draft[name], FIRST[name]);
  put("code", draft.code.replaceAll(/[;:]/g, ""), FIRST.code);
  return parts.join(";");
}

/** Takes of a link what makes sense and leaves the rest; null where it does not say what is waited for. */
export function draftOfText(text: string | undefined, turbine: string | undefined): Draft | null {
  const [first, ...parts] = (text ?? "").split(";");
  const kind = KINDS.find((one) => one === first);
  if (kind === undefined) return null;
  const told = new Map(parts.map((part): [string, string] => [part.split(":")[0] ?? "", restOf(part)]));
  const draft: Draft = { ...FIRST, kind, code: told.get("code") ?? FIRST.code };
  for (const name of PLACES) {
    const place = told.get(name);
    if (place !== undefined && turbine !== undefined) draft[name] = `${turbine}/${place}`;
  }
  for (const name of names(NUMBERS)) {
    const number = Number(told.get(name) ?? NaN);
    if (Number.isFinite(number)) draft[NUMBERS[name]] = number;
  }
  return { ...draft, ...choicesOf(told) };
}

function choicesOf(told: ReadonlyMap<string, string>): Partial<Draft> {
  const chosen = names(CHOICES).flatMap((name: Choice) => {
    const options: readonly string[] = CHOICES[name];
    const value = options.find((one) => one === told.get(name));
    return value === undefined ? [] : [[name, value]];
  });
  return Object.fromEntries(chosen) as Partial<Draft>;
}

const restOf = (part: string) => part.slice(part.indexOf(":") + 1);
const withoutTurbine = (name: string | null) => (name === null ? null : name.slice(name.indexOf("/") + 1));

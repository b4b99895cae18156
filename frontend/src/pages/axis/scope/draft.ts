/** What a person is about to ask of the scope, as it is typed, and the order that comes of it. */
import type { ArmRequest, ScopeLine, TriggerIn } from "../../../api/scope";

export type Kind = TriggerIn["kind"];
export type EventKind = NonNullable<TriggerIn["event"]>;

export interface Draft {
  kind: Kind;
  signal: string | null;
  level: number;
  slope: "rising" | "falling" | "either";
  side: "above" | "below";
  event: EventKind;
  device: string | null;
  /** As it is typed, hexadecimal; empty is any. */
  code: string;
  totalS: number;
  preS: number;
  mode: "single" | "normal" | "auto";
  holdOffS: number;
  autoS: number;
}

export const MAX_SIGNALS = 16;
export const FIRST: Draft = {
  kind: "manual",
  signal: null,
  level: 0,
  slope: "rising",
  side: "above",
  event: "axis_state",
  device: null,
  code: "",
  totalS: 5,
  preS: 1,
  mode: "single",
  holdOffS: 0,
  autoS: 2,
};

/** What was armed last, so that a page that is opened later starts from it. */
export function draftOf(order: NonNullable<ScopeLine["order"]>): Draft {
  const { trigger } = order;
  return {
    kind: trigger.kind,
    signal: trigger.signal,
    level: trigger.level ?? FIRST.level,
    slope: trigger.slope ?? FIRST.slope,
    side: trigger.side ?? FIRST.side,
    event: trigger.event ?? FIRST.event,
    device: trigger.device,
    code: trigger.code === null ? "" : trigger.code.toString(16).toUpperCase(),
    totalS: order.total_s,
    preS: order.pre_s,
    mode: order.mode,
    holdOffS: order.hold_off_s,
    autoS: order.auto_s,
  };
}

/** The number of a typed code; null where any counts, undefined where it is none. */
export function codeOf(typed: string): number | null | undefined {
  const text = typed.trim().replace(/h$/i, "");
  if (text === "") return null;
  const number = /^[0-9a-f]{1,4}$/i.test(text) ? parseInt(text, 16) : 0;
  return number === 0 ? undefined : number;
}

/** Null where something is missing that this kind needs. */
export function orderOf(draft: Draft, signals: readonly string[]): ArmRequest | null {
  const trigger = triggerOf(draft);
  if (trigger === null || signals.length === 0) return null;
  return {
    signals: [...signals],
    trigger,
    total_s: draft.totalS,
    pre_s: draft.preS,
    mode: draft.mode,
    hold_off_s: draft.holdOffS,
    auto_s: draft.autoS,
  };
}

function triggerOf({ kind, signal, level, slope, side, event, device, code }: Draft): TriggerIn | null {
  if (kind === "manual") return { kind };
  if (kind === "edge") return signal === null ? null : { kind, signal, level, slope };
  if (kind === "level") return signal === null ? null : { kind, signal, level, side };
  if (kind === "fault") {
    const number = codeOf(code);
    return number === undefined ? null : { kind, device, code: number };
  }
  if (event !== "bit") return { kind, event, device };
  return signal === null ? null : { kind, event, signal };
}

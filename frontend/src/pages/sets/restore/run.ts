/** A restore that runs or has ended: how far it is, and how far each of its values. */
import type { RestoreDoc, RestoreValue } from "../../../api/restore";

export enum Phase {
  Writing = "writing",
  Confirmation = "confirmation",
  Saving = "saving",
  Restarting = "restarting",
  Proving = "proving",
}

export type Standing = "done" | "now" | "waiting" | "failed";

const PHASE_OF: Partial<Record<RestoreDoc["state"], Phase>> = {
  writing: Phase.Writing,
  "awaiting-confirmation": Phase.Confirmation,
  saving: Phase.Saving,
  restarting: Phase.Restarting,
  proving: Phase.Proving,
};

/** The phases on the way to the new values, each with how it stands; null on the way back and where it was cut off. */
export function phasesOf(doc: RestoreDoc): { phase: Phase; standing: Standing }[] | null {
  const phases = Object.values(Phase).filter((one) => doc.restart || one !== Phase.Restarting);
  if (doc.state === "done") return phases.map((phase) => ({ phase, standing: "done" }));
  const now = PHASE_OF[doc.state];
  if (now === undefined) return null;
  const at = phases.indexOf(now);
  return phases.map((phase, index) => ({
    phase,
    standing: index < at ? "done" : index === at ? "now" : "waiting",
  }));
}

/** How far one value is. Back: its old value was put back. Untouched: the restore ended before its turn. */
export enum Stage {
  Equal = "equal",
  Waiting = "waiting",
  Untouched = "untouched",
  Sent = "sent",
  ReadBack = "read-back",
  Saved = "saved",
  Proven = "proven",
  Back = "back",
  Failed = "failed",
  Unknown = "unknown",
}

/** Devices whose values were saved (`device category` where only these were), and those whose values were read again after that, on the way taken last. */
export interface Kept {
  saved: ReadonlySet<string>;
  proven: ReadonlySet<string>;
  /** Nothing more is written. */
  ended: boolean;
}

export function keptOf(doc: RestoreDoc): Kept {
  const direction = doc.steps.at(-1)?.direction;
  const done = doc.steps.filter((step) => step.direction === direction && step.state === "done");
  const devices = (kind: string) =>
    new Set(done.filter((step) => step.kind === kind).map((step) => step.device));
  const saves = done.filter((step) => step.kind === "save");
  const saved = new Set(saves.map((step) => partOf(step.device, step.category)));
  // Saved values are proven by reading them once the device has started anew.
  const restarted = devices("restart");
  const read = devices("prove");
  const proven = new Set([...devices("save")].filter((slug) => restarted.has(slug) && read.has(slug)));
  return { saved, proven, ended: doc.end !== null };
}

const partOf = (device: string, category: string | null): string =>
  category === null ? device : `${device} ${category}`;

export function stageOf(value: RestoreValue, { saved, proven, ended }: Kept): Stage {
  if (value.state === "failed") return Stage.Failed;
  if (value.state === "unknown") return Stage.Unknown;
  if (value.state === "intended") return Stage.Sent;
  if (value.state === "done" && value.written === "before") return Stage.Back;
  if (value.state === "waiting") return ended ? Stage.Untouched : Stage.Waiting;
  if (proven.has(value.device)) return Stage.Proven;
  if (saved.has(value.device) || saved.has(partOf(value.device, value.save_category))) return Stage.Saved;
  return value.state === "equal" ? Stage.Equal : Stage.ReadBack;
}

/** Share of the steps that are done, in percent. */
export const shareOf = ({ done, total }: RestoreDoc): number => (total === 0 ? 0 : (100 * done) / total);

/** `4:07` of seconds that are left. */
export function minutesOf(leftS: number): string {
  const whole = Math.max(0, Math.ceil(leftS));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

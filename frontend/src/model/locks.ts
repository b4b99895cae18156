/** Why an object cannot be written here by this person; the server holds to the same rules. */
import type { EntryDoc, Session } from "../api/types";

export enum Lock {
  /** What is shown is a recording. */
  Replay = "replay",
  Viewer = "viewer",
  ReadOnly = "ro",
  Constant = "const",
  Factory = "r_factory",
  Motion = "motion",
  Communication = "communication",
}

const PDO_FIRST = 0x1400;
const PDO_END = 0x1c00;
const COMMANDS = [0x1010, 0x1011];

export function lockOf(entry: EntryDoc, role: Session["role"], recorded = false): Lock | null {
  if (entry.access === "const") return Lock.Constant;
  if (entry.access === "r(w)" && role !== "expert") return Lock.Factory;
  if (entry.access === "ro") return Lock.ReadOnly;
  if (entry.motion) return Lock.Motion;
  if (isCommunication(entry)) return Lock.Communication;
  if (recorded) return Lock.Replay;
  return role === "viewer" ? Lock.Viewer : null;
}

/** PDO parameters and mappings of CiA 301, and the commands that save or load. */
function isCommunication({ address }: EntryDoc): boolean {
  const index = /^([0-9A-F]{4})(?::|$)/i.exec(address)?.[1];
  if (index === undefined) return false;
  const number = Number.parseInt(index, 16);
  return (number >= PDO_FIRST && number < PDO_END) || COMMANDS.includes(number);
}

/** What the person who is signed in may do. The server refuses by itself: this only says so beforehand, and why. */
import { useQuery } from "@tanstack/react-query";
import { sessionQuery } from "../api/queries";
import type { Session } from "../api/types";
import { type Translate, useTexts } from "../texts/texts";

export type Role = Session["role"];

/** From least to most. */
export const ROLES: readonly Role[] = ["viewer", "technician", "expert"];

export function covers(role: Role, needed: Role): boolean {
  return ROLES.indexOf(role) >= ROLES.indexOf(needed);
}

/** Why a person of this role may not; null where they may. */
export function roleReason(role: Role, needed: Role, t: Translate): string | null {
  if (covers(role, needed)) return null;
  return t("page.role.needs", { needed: t(`page.role.${needed}`), role: t(`page.role.${role}`) });
}

export interface OwnRole {
  role: Role;
  may: (needed: Role) => boolean;
  /** The reason to show beside what is disabled; null where it is allowed. */
  why: (needed: Role) => string | null;
}

/** The own role; least rights until the session is known. */
export function useRole(): OwnRole {
  const t = useTexts();
  const role = useQuery(sessionQuery).data?.role ?? "viewer";
  return {
    role,
    may: (needed) => covers(role, needed),
    why: (needed) => roleReason(role, needed, t),
  };
}

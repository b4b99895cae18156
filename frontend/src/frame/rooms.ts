/**
 * The rooms of the page: where each is, and the last part of the key of its name. The instructor's is shown only where
 * the server has started the twins that are connected.
 */
export const ROOMS = [
  { path: "/", name: "overview" },
  { path: "/axis", name: "axis" },
  { path: "/parameters", name: "parameters" },
  { path: "/sets", name: "sets" },
  { path: "/recordings", name: "recordings" },
  { path: "/bus", name: "bus" },
  { path: "/procedures", name: "procedures" },
  { path: "/settings", name: "settings" },
  { path: "/instructor", name: "instructor" },
] as const;

export const INSTRUCTOR = "/instructor";

/** Rooms that are about the bench and what is kept, whatever the page shows. */
export const LIVE_ROOMS: readonly string[] = ["/sets", "/procedures", "/settings", INSTRUCTOR];

export type RoomPath = (typeof ROOMS)[number]["path"];

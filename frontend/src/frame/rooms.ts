/** The rooms of the page: where each is, and the last part of the key of its name. */
export const ROOMS = [
  { path: "/", name: "overview" },
  { path: "/axis", name: "axis" },
  { path: "/parameters", name: "parameters" },
  { path: "/sets", name: "sets" },
  { path: "/recordings", name: "recordings" },
  { path: "/bus", name: "bus" },
  { path: "/procedures", name: "procedures" },
  { path: "/settings", name: "settings" },
] as const;

export type RoomPath = (typeof ROOMS)[number]["path"];

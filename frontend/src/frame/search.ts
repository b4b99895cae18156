/** All state of the page that a link can share lives in the URL; this is its shape. */
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useCallback } from "react";
import type { Language } from "../api/types";

export type Theme = "dark" | "light";

export interface PageSearch {
  lang?: Language;
  theme?: Theme;
  /** The 3D dock is open unless it says "off". */
  scene?: "off";
  /** Where it is looked at from; unset is from the front. */
  camera?: string;
  /** Ghosts at the demanded angles are shown unless it says "off". */
  ghost?: "off";
  events?: "open";
  /** The recording that is replayed, and the time at which its cursor stands, in ns. */
  replay?: string;
  at?: string;
  device?: string;
  q?: string;
  /** Which parameters are shown: "changed", "different", "unsaved", "starred", "pending", separated by commas. */
  only?: string;
  /** All devices of the kind side by side. */
  view?: "side";
  /** The review of what is pending is open. */
  review?: "open";
  /** The list of what the rules find is open. */
  findings?: "open";
  /** Groups that are closed, separated by commas. */
  closed?: string;
  /** Column, with a minus sign before it where descending. */
  sort?: string;
  /** Columns that are hidden, separated by commas. */
  hide?: string;
  /** Address of the parameter that is open. */
  edit?: string;
  /** Number of the blade that the axis room shows. */
  blade?: string;
  /** Seconds that its plots span. */
  span?: string;
  /** The picture of the setting up that is open. */
  picture?: string;
  /** The PDO that is open to be changed. */
  pdo?: string;
  /** The gear trains that are typed there, of the motor and of the blade encoder ("1024/1~1/183x12/111~36000/1"). */
  gear?: string;
  ae?: string;
  /** The run of a test signal that is shown, and the one that is laid over it. */
  run?: string;
  over?: string;
  /** Name of the recording or set that is open. */
  file?: string;
  /** Filter, order (column, minus sign where descending) and hidden columns of the tables of files, sets and the bus. */
  find?: string;
  order?: string;
  less?: string;
  /** "different" shows of a set only what differs from the device now. */
  compare?: "different";
  /** What the instructor's room is about to inject: node, and values that are not the defaults ("percent:30;for:10"). */
  node?: string;
  set?: string;
  /** The scenario that is open. */
  scenario?: string;
  /** The procedure that is open. */
  procedure?: string;
  /** Filter and least severity of the event drawer, and whether it is "tall". */
  eventq?: string;
  severity?: string;
  drawer?: string;
  /** Section of the settings, and the filters of its audit log. */
  section?: string;
  person?: string;
  kind?: string;
  /** View of the bus room, and the filters of its trace. */
  tab?: string;
  nodes?: string;
  services?: string;
  ids?: string;
  data?: string;
  dir?: string;
  errors?: string;
  /** The trace stands still. */
  paused?: string;
  /** Time stamp of the frame that is shown, in ns. */
  frame?: string;
  /** What is compared, separated by commas ("live:wtg-07/blade-1/pmc,set:0199…"), and which rows are shown of it. */
  columns?: string;
  rows?: string;
  group?: string;
  /** The turbine whose blades are compared, where it is not the connected one, and of when: "latest" or now. */
  turbine?: string;
  of?: "latest";
  /** The golden set of the fleet, the station that is restored, and the sets that are restored there. */
  golden?: string;
  station?: string;
  sets?: string;
  /** Addresses that are picked to be restored, separated by commas. */
  select?: string;
  motor?: string;
  /** The restore that is open. */
  restore?: string;
  /** What the plots of a replay show, and the stretch in view in s since its beginning ("12.5-14"). */
  plots?: string;
  window?: string;
  /** The moment that a replay's parameters are compared with: a time in ns, or "latest", "golden", "delivered". */
  against?: string;
  /** Code of the incident that is open, and the stretch that its link loops, in ns ("from-to"). */
  incident?: string;
  loop?: string;
  /** What is laid over: recordings with their zeros, and the signals of all of them (pages/recordings/overlay/choice.ts). */
  overlay?: string;
  curves?: string;
  /** Of the scope: signals without their turbine, what it waits for and for how long (pages/axis/scope/draftText.ts). */
  channels?: string;
  trigger?: string;
  /** The capture that is open, "fft" or "xy", captures laid over, "each" signal on an axis of its own. */
  capture?: string;
  measure?: string;
  refs?: string;
  axes?: string;
  /** Axes of values that were set by hand (pages/axis/scope/scales.ts). */
  yscale?: string;
  /** Its stretch in view and its two cursors, in s since the trigger ("-0.5..1.5"). */
  zoom?: string;
  cursors?: string;
  /** The signal of its spectrum, and the two of its XY ("x,y"). */
  spectrum?: string;
  xy?: string;
}

const TEXTS = [
  "replay",
  "at",
  "device",
  "q",
  "only",
  "closed",
  "sort",
  "hide",
  "edit",
  "blade",
  "camera",
  "span",
  "picture",
  "pdo",
  "gear",
  "ae",
  "run",
  "over",
  "file",
  "find",
  "order",
  "less",
  "node",
  "set",
  "scenario",
  "procedure",
  "eventq",
  "severity",
  "drawer",
  "section",
  "person",
  "kind",
  "tab",
  "nodes",
  "services",
  "ids",
  "data",
  "dir",
  "errors",
  "paused",
  "frame",
  "columns",
  "rows",
  "group",
  "turbine",
  "golden",
  "station",
  "sets",
  "select",
  "motor",
  "restore",
  "plots",
  "window",
  "against",
  "incident",
  "loop",
  "overlay",
  "curves",
  "channels",
  "trigger",
  "capture",
  "measure",
  "refs",
  "axes",
  "yscale",
  "zoom",
  "cursors",
  "spectrum",
  "xy",
] as const;

/**
 * What goes along from room to room: how the page looks, which recording it shows, and which blade and device it is about. Everything else belongs
 * to one room and would mean something else, or nothing, in another: a name filtered for in the parameters would hide
 * the frames of the bus.
 */
const TRAVELS = [
  "lang",
  "theme",
  "scene",
  "camera",
  "ghost",
  "events",
  "eventq",
  "severity",
  "drawer",
  "replay",
  "at",
  "device",
  "blade",
] as const satisfies readonly (keyof PageSearch)[];

/** The search with which another room is opened; `own` is what is to be seen there. */
export function roomSearch(before: PageSearch, own: PageSearch = {}): PageSearch {
  const along = Object.fromEntries(TRAVELS.map((name) => [name, before[name]]));
  return readSearch({ ...along, ...own });
}

/** Takes what is valid and leaves the rest: a damaged link opens the page all the same. */
export function readSearch(raw: Record<string, unknown>): PageSearch {
  const search: PageSearch = {};
  if (raw.lang === "en" || raw.lang === "de") search.lang = raw.lang;
  if (raw.theme === "dark" || raw.theme === "light") search.theme = raw.theme;
  if (raw.scene === "off") search.scene = raw.scene;
  if (raw.ghost === "off") search.ghost = raw.ghost;
  if (raw.compare === "different") search.compare = raw.compare;
  if (raw.events === "open") search.events = raw.events;
  if (raw.view === "side") search.view = raw.view;
  if (raw.review === "open") search.review = raw.review;
  if (raw.findings === "open") search.findings = raw.findings;
  if (raw.of === "latest") search.of = raw.of;
  for (const name of TEXTS) {
    const text = raw[name];
    if (typeof text === "string" && text !== "") search[name] = text;
  }
  if (search.plots === undefined && typeof raw.signals === "string" && raw.signals !== "")
    search.plots = plotsOfLink(raw.signals);
  return search;
}

/** The short link of an incident names its signals with their turbine; plots of the page are of any turbine. */
const plotsOfLink = (signals: string): string => signals.replace(/(^|[,;])[^/,;]+\//g, "$1");

/** Plain `name=text` pairs, so that `?device=wtg-07/blade-2/pmc&edit=3110:01` reads as it is written. */
export function parseSearch(text: string): Record<string, string> {
  return Object.fromEntries(new URLSearchParams(text));
}

export function stringifySearch(search: Record<string, unknown>): string {
  const pairs = Object.entries(search).filter(
    (pair): pair is [string, string] => typeof pair[1] === "string",
  );
  if (pairs.length === 0) return "";
  return `?${new URLSearchParams(pairs).toString().replaceAll("%2F", "/").replaceAll("%3A", ":").replaceAll("%2C", ",")}`;
}

type Change = { [K in keyof PageSearch]?: PageSearch[K] | undefined };

/** The search of the URL and a way to change parts of it; `undefined` takes a part out. */
export function usePageSearch(): [PageSearch, (change: Change) => void] {
  const search: PageSearch = useSearch({ strict: false });
  const navigate = useNavigate();
  const update = useCallback(
    (change: Change) => {
      void navigate({
        to: ".",
        search: (before: PageSearch) => readSearch({ ...before, ...change }),
        replace: true,
      });
    },
    [navigate],
  );
  return [search, update];
}

/** Goes to a section of the settings. */
export function useOpenSettings(): (section: string) => void {
  const navigate = useNavigate();
  return useCallback(
    (section: string) => {
      void navigate({
        to: "/settings",
        search: (before: PageSearch) => roomSearch(before, { section }),
      });
    },
    [navigate],
  );
}

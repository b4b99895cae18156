/** How often components are rendered, by React itself; what they show is nothing, so that no document is needed. */
import { createElement, type FunctionComponent, type ReactNode } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { AxisData, DescriptionDoc, EntryDoc, ServerMessage } from "../api/types";
import type { DeviceContext } from "../model/shown";
import { figure } from "../model/values";
import { bootTranslator } from "../texts/texts";
import { rawAt, useReading } from "../ui/reading";
import { Channel, LIVE } from "./channel";
import { DRAW_MS } from "./pace";
import { live, ShownContext, useAxis, useDerived, useHearing, useMayMove, useServerNow } from "./live";

const PMC = "wtg-07/blade-1/pmc";
const AT_NS = 1_700_000_000_000_000_000;

class Frame {
  readonly nodeType = 1;
}

/** As much of a document as React asks for. */
const document = { nodeType: 9, addEventListener: vi.fn(), activeElement: null };
const container = { nodeType: 1, tagName: "DIV", ownerDocument: document, addEventListener: vi.fn() };

// For all of the file: React may look once more after the last test.
vi.stubGlobal("window", { event: undefined, document, HTMLIFrameElement: Frame });
vi.stubGlobal("document", document);

let channel: Channel;
let root: Root;
let counts: Record<string, number>;
let seen: Record<string, unknown>;

/** A component that shows what `look` gives, and counts how often it is rendered. */
function counting(name: string, look: () => unknown): FunctionComponent<{ children?: ReactNode }> {
  return ({ children }) => {
    counts[name] = (counts[name] ?? 0) + 1;
    seen[name] = look();
    return children;
  };
}

function tell<T extends ServerMessage["type"]>(
  type: T,
  data: Extract<ServerMessage, { type: T }>["data"],
  to: Channel = channel,
  tNs = AT_NS,
): void {
  to.store.apply({ v: 1, ctx: LIVE, type, seq: 1, t_ns: tNs, data } as ServerMessage);
}

const axis = (blade: number, deg: number, state = "switched_on"): AxisData =>
  ({
    station: `wtg-07/blade-${blade}`,
    blade,
    position_deg: deg,
    velocity_dps: 0,
    state: `axis_state.${state}`,
    stale: false,
  }) as AxisData;

/** More than React takes for anything here: it gives the turn away after every component on a slow machine. */
const TURNS = 60;
const tick = () => new Promise((resolve) => setImmediate(resolve));
async function settled(): Promise<void> {
  for (let turn = 0; turn < TURNS; turn += 1) await tick();
}

const whole = counting("whole", () => null);

async function shown(...components: FunctionComponent[]): Promise<void> {
  root.render(
    createElement(
      ShownContext,
      { value: channel },
      createElement(whole, null, ...components.map((one) => createElement(one))),
    ),
  );
  await settled();
}

beforeEach(() => {
  counts = {};
  seen = {};
  channel = new Channel(LIVE, () => (flush) => flush());
  root = createRoot(container as unknown as Element);
});
afterEach(async () => {
  root.unmount();
  await settled();
  vi.useRealTimers();
});

const angleOf = (blade: number) => () =>
  useAxis(blade, (one) => (one?.position_deg == null ? "–" : figure(one.position_deg, 2, "en")));

describe("a value that changes", () => {
  it("has only that rendered which shows it", async () => {
    tell("axes", [axis(1, 10), axis(2, 20)]);
    const state = counting("state", () => useAxis(1, (one) => ({ state: one?.state, stale: one?.stale })));
    await shown(counting("angle 1", angleOf(1)), counting("angle 2", angleOf(2)), state);
    expect(seen).toMatchObject({ "angle 1": "10.00", "angle 2": "20.00" });
    const first = { ...counts };

    tell("axes", [axis(1, 11), axis(2, 20)]);
    await settled();
    expect(seen["angle 1"]).toBe("11.00");
    expect(counts).toEqual({ ...first, "angle 1": (first["angle 1"] ?? 0) + 1 });

    // Finer than what is shown: nobody sees it.
    tell("axes", [axis(1, 11.001), axis(2, 20.001)]);
    await settled();
    expect(counts).toEqual({ ...first, "angle 1": (first["angle 1"] ?? 0) + 1 });
  });

  it("is rendered once, however many messages came before its turn", async () => {
    await shown(counting("angle", angleOf(1)));
    const first = counts.angle ?? 0;
    for (let deg = 1; deg <= 50; deg += 1) tell("axes", [axis(1, deg)]);
    await settled();
    expect(seen.angle).toBe("50.00");
    expect(counts.angle).toBe(first + 1);
  });

  it("waits for its turn, but whether anything may move is told at once", async () => {
    vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] });
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
    tell("axes", [axis(1, 10)], live);
    vi.advanceTimersByTime(DRAW_MS);
    const moving = counting("moving", useMayMove);
    const angle = counting("angle", () => useAxis(1, (one) => one?.position_deg));
    channel = live;
    await shown(moving, angle);
    expect(seen).toMatchObject({ moving: false, angle: 10 });
    tell("axes", [axis(1, 12, "operation_enabled")], live);
    vi.advanceTimersByTime(DRAW_MS);
    await Promise.resolve();
    await Promise.resolve();
    expect(seen).toMatchObject({ moving: true, angle: 10 });
    await settled();
    expect(seen.angle).toBe(12);
  });

  it("keeps its identity while it is alike, for what is handed on", async () => {
    tell("axes", [axis(1, 10)]);
    const pair = counting("pair", () => useDerived(["axes"], ({ axes }) => [axes.get(1)?.position_deg]));
    await shown(pair);
    const before = seen.pair;
    await shown(pair);
    expect(counts.pair).toBe(2);
    expect(seen.pair).toBe(before);
  });
});

const NO_RULES = { enumeration_from: null, bits_from: null, limits_from: null };

const DOC = {
  entries: [
    { address: "6064", title: "position", scale: 0.01, unit: "°", decimals: 1, unit_from: null },
    { address: "606C", title: "velocity", scale: 1, unit: "°/s", decimals: 0, unit_from: null },
  ].map(
    (one) =>
      ({ enumeration: null, bits: null, hexadecimal: false, ...NO_RULES, ...one }) as unknown as EntryDoc,
  ),
  variant_matches: [],
  bit_tables: {},
  enumerations: {},
} as unknown as DescriptionDoc;

const contextOf = (): DeviceContext => ({
  slug: PMC,
  node: 11,
  doc: DOC,
  lookup: (address) => rawAt(channel.store, PMC, address),
  t: bootTranslator("en"),
});

const value = (raw: number, tNs = AT_NS) => ({
  raw,
  hex: raw.toString(16),
  t_ns: tNs,
  source: "pdo" as const,
  stored: null,
  known: true,
  stale: false,
});

describe("a reading", () => {
  const nodes = (silent: boolean) => [{ device: PMC, node: 11, silent }] as never;

  it("is not rendered for heartbeats, other objects or the same value read again, but for its own and for silence", async () => {
    live.store.setHearing({ state: "hearing", sinceMs: null });
    tell("link", { state: "connected" } as never);
    tell("nodes", nodes(false));
    tell("values", { device: PMC, full: true, values: { "6064": value(1000), "606C": value(0) } });
    const context = contextOf();
    await shown(counting("position", () => useReading(context, "6064", "fast")));
    expect(seen.position).toMatchObject({ raw: 1000, text: "10.0", stale: false });
    const first = counts.position ?? 0;

    tell("nodes", nodes(false));
    tell("link", { state: "connected", load: 0.4 } as never);
    tell("values", { device: PMC, full: false, values: { "606C": value(3) } });
    tell("values", { device: PMC, full: false, values: { "6064": value(1000, AT_NS + 5e6) } });
    await settled();
    expect(counts.position).toBe(first);

    tell("values", { device: PMC, full: false, values: { "6064": value(1010) } });
    await settled();
    expect(seen.position).toMatchObject({ raw: 1010, text: "10.1" });
    expect(counts.position).toBe(first + 1);

    tell("nodes", nodes(true));
    await settled();
    expect(seen.position).toMatchObject({ stale: true });
    expect(counts.position).toBe(first + 2);
  });

  it("grows old by itself, and its age is renewed as long as it is shown", async () => {
    vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "Date"], now: AT_NS / 1e6 });
    live.store.setHearing({ state: "hearing", sinceMs: null });
    tell("link", { state: "connected" } as never);
    tell("values", { device: PMC, full: true, values: { "6064": value(1000) } });
    const context = contextOf();
    await shown(counting("position", () => useReading(context, "6064", "fast")));
    const first = counts.position ?? 0;
    vi.advanceTimersByTime(1000);
    await settled();
    expect(counts.position).toBe(first);
    vi.advanceTimersByTime(1000);
    await settled();
    expect(seen.position).toMatchObject({ stale: true, ageMs: 2000 });
    vi.advanceTimersByTime(1000);
    await settled();
    expect(seen.position).toMatchObject({ ageMs: 3000 });
  });
});

describe("what the page hears, and the time", () => {
  it("are told to each that shows them", async () => {
    vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "Date"], now: AT_NS / 1e6 });
    live.store.setHearing({ state: "hearing", sinceMs: null });
    const now = counting("now", () => useServerNow(500));
    await shown(
      now,
      counting("hearing", () => useHearing().state),
    );
    vi.advanceTimersByTime(500);
    await settled();
    expect(seen).toMatchObject({ now: AT_NS / 1e6 + 500, hearing: "hearing" });
  });
});

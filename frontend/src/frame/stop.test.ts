import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { AxisData, LinkData, MotionData } from "../api/types";
import { liveStore } from "../live/live";
import { lendStop, stopOnEscape } from "./stop";

/** One function hears the keys of the page and those of the 3D frame. */
function press(key: string, repeat = false): boolean {
  let taken = false;
  const take = () => {
    taken = true;
  };
  stopOnEscape({
    key,
    repeat,
    preventDefault: take,
    stopImmediatePropagation: take,
  } as unknown as KeyboardEvent);
  return taken;
}

function tell(
  state: string | null,
  link: "connected" | "lost" | "disconnected" = "connected",
  stale = false,
): void {
  const envelope = { v: 1, ctx: "live", seq: 1, t_ns: 1e9 } as const;
  liveStore.apply({ ...envelope, type: "link", data: { state: link, load: 0 } as LinkData });
  const axis = { blade: 1, state, stale, velocity_dps: 0 } as AxisData;
  liveStore.apply({ ...envelope, type: "axes", data: [axis] });
}

describe("Esc", () => {
  let stops = 0;
  let takeBack: () => void;

  beforeEach(() => {
    vi.stubGlobal("document", { hidden: true });
    stops = 0;
    takeBack = lendStop(() => {
      stops += 1;
    });
  });

  afterEach(() => {
    takeBack();
    vi.unstubAllGlobals();
  });

  it("is STOP and nothing else while an axis has power, once however long it is held", () => {
    tell("state.operation_enabled");
    expect(press("Escape")).toBe(true);
    expect(press("Escape", true)).toBe(true);
    expect(stops).toBe(1);
  });

  it("is STOP where the state of an axis is not known", () => {
    tell(null);
    expect(press("Escape")).toBe(true);
    expect(stops).toBe(1);
  });

  it("is STOP where one bus of several is lost, and where the page has gone deaf: an axis may move since", () => {
    tell("state.ready_to_switch_on", "lost");
    expect(press("Escape")).toBe(true);
    tell("state.ready_to_switch_on");
    liveStore.setHearing({ state: "deaf", sinceMs: 1 });
    expect(press("Escape")).toBe(true);
    liveStore.setHearing({ state: "hearing", sinceMs: 2 });
    expect(press("Escape")).toBe(false);
    expect(stops).toBe(2);
  });

  it("is STOP where an axis stood when it was heard last", () => {
    tell("state.ready_to_switch_on", "connected", true);
    expect(press("Escape")).toBe(true);
    expect(stops).toBe(1);
  });

  it("is STOP while the desk commands an axis that is no blade", () => {
    tell("state.ready_to_switch_on");
    const line = { available: true, prepared: [], left: [] } as unknown as MotionData;
    liveStore.takeMotion({ ...line, running: { device: "bench/servo", doing: "jog" } });
    expect(press("Escape")).toBe(true);
    liveStore.takeMotion({ ...line, running: null });
    expect(press("Escape")).toBe(false);
  });

  it("is left to dialogs and menus while all axes are at rest, and where nothing is connected", () => {
    tell("state.ready_to_switch_on");
    expect(press("Escape")).toBe(false);
    tell("state.operation_enabled", "disconnected");
    expect(press("Escape")).toBe(false);
    expect(stops).toBe(0);
  });

  it("leaves other keys alone", () => {
    tell("state.operation_enabled");
    expect(press("Enter")).toBe(false);
    expect(stops).toBe(0);
  });
});

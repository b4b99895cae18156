import { describe, expect, it } from "vitest";
import type { AxisData, LinkData, NodeData, Turbine } from "../../api/types";
import { findingsOf } from "./attention";
import { Heard, heartbeatOf } from "./nodes";

const NOW_MS = 1_700_000_000_000;
const PMC = "wtg-07/blade-1/pmc";

const turbine: Turbine = {
  slug: "wtg-07",
  name: "WTG-07",
  mode: "live",
  bus: { name: "can0", bitrate: 500000, interface: "socketcand" },
  stations: [
    {
      slug: "wtg-07/blade-1",
      name: "Blade 1",
      blade: 1,
      devices: [{ slug: PMC, node: 11, description_id: "oat-pmc", name: "PMC", axis: true, verifies: false }],
    },
  ],
};

const recording = {
  state: "on",
  file: "a",
  since_ns: 0,
  size_bytes: 0,
  frames: 0,
  lost: 0,
  reason: null,
} as const;
const link: LinkData = {
  state: "connected",
  reason: null,
  mode: "live",
  bus: "can0",
  bitrate: 500000,
  load: 0,
  frames: 0,
  dropped: 0,
  recording,
  other_masters: [],
  needs_consent: false,
};
const node = (ageMs: number | null): NodeData => ({
  device: PMC,
  node: 11,
  nmt: "operational",
  silent: ageMs !== null && ageMs > 1000,
  heartbeat_t_ns: ageMs === null ? null : (NOW_MS - ageMs) * 1e6,
  heartbeat_period_ms: 500,
  boots: 1,
  managed: true,
  answered_t_ns: null,
});
const axis = (code: number, severity: "error" | "warning" = "error") =>
  ({
    blade: 1,
    fault_code: code,
    faults: code === 0 ? [] : [{ device: PMC, code, text_key: "error_code.x", severity }],
  }) as unknown as AxisData;

const find = (change: { link?: LinkData; node?: NodeData; axis?: AxisData }) =>
  findingsOf({
    turbine,
    link: change.link ?? link,
    nodes: new Map([[PMC, change.node ?? node(100)]]),
    axes: new Map([[1, change.axis ?? axis(0)]]),
    nowMs: NOW_MS,
  }).map((finding) => `${finding.tone} ${finding.key}`);

describe("heartbeat", () => {
  it("has an age, is overdue where the bench says so, and unknown where none was heard", () => {
    expect(heartbeatOf(node(400), NOW_MS)).toEqual({ heard: Heard.Alive, ageMs: 400 });
    expect(heartbeatOf(node(5000), NOW_MS)).toEqual({ heard: Heard.Overdue, ageMs: 5000 });
    expect(heartbeatOf(node(null), NOW_MS)).toEqual({ heard: Heard.Never, ageMs: null });
    expect(heartbeatOf(undefined, NOW_MS).heard).toBe(Heard.Never);
  });
});

describe("needs attention", () => {
  it("is empty while all is well", () => {
    expect(find({})).toEqual([]);
  });

  it("names faults, silence and losses, errors before warnings", () => {
    expect(find({ axis: axis(0x8611) })).toEqual(["error page.attention.fault"]);
    expect(find({ node: node(5000) })).toEqual(["error page.attention.node_overdue"]);
    expect(find({ node: node(null), axis: axis(1) })).toEqual([
      "error page.attention.fault",
      "warning page.attention.node_silent",
    ]);
    expect(find({ link: { ...link, recording: { ...recording, state: "off", lost: 3 } } })).toEqual([
      "error page.attention.recording_lost",
      "warning page.attention.recording_off",
    ]);
  });

  it("tells a warning of a device from a fault, after all errors", () => {
    expect(find({ axis: axis(0x4310, "warning") })).toEqual(["warning page.attention.device_warning"]);
    expect(find({ axis: axis(0x4310, "warning"), node: node(5000) })).toEqual([
      "error page.attention.node_overdue",
      "warning page.attention.device_warning",
    ]);
  });

  it("does not blame the nodes while the bus is gone", () => {
    expect(find({ link: { ...link, state: "lost", reason: "cut" }, node: node(9000) })).toEqual([
      "error page.attention.link_lost",
    ]);
  });

  it("shows the code as the manuals print it, and leads to the device", () => {
    const [finding] = findingsOf({
      turbine,
      link,
      nodes: new Map([[PMC, node(0)]]),
      axes: new Map([[1, axis(0x611)]]),
      nowMs: NOW_MS,
    });
    expect(finding?.details.code).toBe("0611h");
    expect(finding?.device).toBe(PMC);
  });
});

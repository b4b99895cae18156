/** What needs a look, worst first. Each finding names the text and where to go. */
import type { AxisData, Details, LinkData, NodeData, Turbine } from "../../api/types";
import type { PageSearch } from "../../frame/search";
import { placesOf } from "../../ui/devices";
import { errorCode } from "../../ui/format";
import { Heard, heartbeatOf } from "./nodes";

export interface Finding {
  id: string;
  tone: "error" | "warning" | "info";
  key: string;
  details: Details;
  /** Slug of the device to open, if one is meant. */
  device: string | null;
  /** What more of the parameters' filter leads there. */
  search?: PageSearch;
}

interface Seen {
  turbine: Turbine | undefined;
  link: LinkData | null;
  nodes: ReadonlyMap<string, NodeData>;
  axes: ReadonlyMap<number, AxisData>;
  nowMs: number;
  /** What the values of the devices give; see `deviceFindings`. */
  more?: readonly Finding[];
}

const URGENCY = ["error", "warning", "info"] as const;

export function findingsOf(seen: Seen): Finding[] {
  const told = [
    ...linkFindings(seen.link),
    ...axisFindings(seen),
    ...nodeFindings(seen),
    ...(seen.more ?? []),
  ];
  const all = [...new Map(told.map((one) => [one.id, one])).values()];
  return URGENCY.flatMap((tone) => all.filter((one) => one.tone === tone));
}

function linkFindings(link: LinkData | null): Finding[] {
  if (!link) return [];
  const found: Finding[] = [];
  const add = (tone: Finding["tone"], id: string, details: Details = {}) =>
    found.push({ id, tone, key: `page.attention.${id}`, details, device: null });
  if (link.state !== "connected") add("error", `link_${link.state}`, { reason: link.reason });
  if (link.recording.state === "stopped")
    add("error", "recording_stopped", { text_key_reason: link.recording.reason });
  // While nothing is connected there is nothing to record, and a recording is not recorded again.
  const recordable = link.state !== "disconnected" && link.mode !== "replay";
  if (link.recording.state === "off" && recordable) add("warning", "recording_off");
  if (link.recording.lost > 0) add("error", "recording_lost", { lost: link.recording.lost });
  if (link.dropped > 0) add("error", "frames_dropped", { dropped: link.dropped });
  if (link.other_masters.length > 0) add("warning", "other_masters");
  return found;
}

function axisFindings({ axes }: Seen): Finding[] {
  return [...axes.values()].flatMap((axis) =>
    axis.faults.map((fault): Finding => ({
      id: `fault_${fault.device}_${fault.code}`,
      tone: fault.severity,
      key: `page.attention.${fault.severity === "error" ? "fault" : "device_warning"}`,
      details: {
        blade: axis.blade,
        station: null,
        device: lastPart(fault.device),
        code: errorCode(fault.code),
        text_key_text: fault.text_key ?? "page.card.unknown_code",
      },
      device: fault.device,
    })),
  );
}

const lastPart = (slug: string) => (slug.split("/").at(-1) ?? slug).toUpperCase();

function nodeFindings({ turbine, link, nodes, nowMs }: Seen): Finding[] {
  if (link?.state !== "connected") return [];
  return placesOf(turbine).flatMap(({ station, device }): Finding[] => {
    const node = nodes.get(device.slug);
    const { heard, ageMs } = heartbeatOf(node, nowMs);
    const details = {
      blade: station.blade,
      station: station.name,
      device: device.name,
      seconds: Math.round((ageMs ?? 0) / 1000),
    };
    const finding = (tone: Finding["tone"], name: string): Finding[] => [
      { id: `${name}_${device.slug}`, tone, key: `page.attention.${name}`, details, device: device.slug },
    ];
    if (heard === Heard.Never) return finding("warning", "node_silent");
    if (heard === Heard.Overdue) return finding("error", "node_overdue");
    return node?.nmt === "stopped" ? finding("warning", "node_stopped") : [];
  });
}

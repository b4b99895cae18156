/** The lanes of the temperatures: supervisors and controllers by the place that they look after (manual 4.6, 5.1, 5.2). */
import { SENSOR_OPEN, SENSOR_SHORT, TEMPERATURES, type Temperature } from "../../../overview/layout";
import { between, type Bounds, type Neighbour } from "../common/bounds";

/** Between two lines of the scale, in °C. */
export const STEP = 20;

export type MarkKind = "lower" | "warning" | "error" | "heater" | "cooler" | "fan";

export interface MarkAt {
  kind: MarkKind;
  address: string;
}

export interface SupervisorLane {
  kind: "supervisor";
  on: "pmm" | "pmc";
  /** The object that holds it, for its name. */
  index: string;
  marks: readonly MarkAt[];
  /** Its status byte (table 32); the PMC has none. */
  status: string | null;
}

export interface ControllerLane {
  kind: "controller";
  on: "pmm";
  index: string;
  heater: string | null;
  cooler: string;
  hysteresis: string;
  /** Masks of its outputs, and the delay of its fan. */
  outputs: readonly { kind: "heater" | "cooler" | "fan"; address: string }[];
  delay: string | null;
  status: string | null;
}

export type Lane = SupervisorLane | ControllerLane;

/** A sensor with what supervises and what controls by it. */
export interface Spot {
  spot: Temperature;
  lanes: readonly Lane[];
}

const supervisor = (index: string, status: string): SupervisorLane => ({
  kind: "supervisor",
  on: "pmm",
  index,
  marks: [
    { kind: "lower", address: `${index}:03` },
    { kind: "warning", address: `${index}:01` },
    { kind: "error", address: `${index}:02` },
  ],
  status,
});

const ofPmc = (index: string, warning: string, error: string): SupervisorLane => ({
  kind: "supervisor",
  on: "pmc",
  index,
  marks: [
    { kind: "warning", address: warning },
    { kind: "error", address: error },
  ],
  status: null,
});

const controller = (index: string, status: string): ControllerLane => ({
  kind: "controller",
  on: "pmm",
  index,
  heater: `${index}:01`,
  cooler: `${index}:02`,
  hysteresis: `${index}:03`,
  outputs: [
    { kind: "heater", address: `${index}:04` },
    { kind: "cooler", address: `${index}:05` },
    { kind: "fan", address: `${index}:06` },
  ],
  delay: `${index}:07`,
  status,
});

/** The fan of the motor is switched by the PMM, with the temperature that the PMC sends. */
const MOTOR_FAN: ControllerLane = {
  kind: "controller",
  on: "pmm",
  index: "3204",
  heater: null,
  cooler: "3204:01",
  hysteresis: "3204:02",
  outputs: [{ kind: "fan", address: "3204:03" }],
  delay: null,
  status: null,
};

const LANES: Readonly<Record<string, readonly Lane[]>> = {
  battery: [supervisor("3110", "3006"), controller("3201", "3006")],
  sensor_1: [supervisor("3112", "3008"), controller("3202", "3008")],
  sensor_2: [supervisor("3113", "3009"), controller("3203", "3009")],
  motor: [ofPmc("6410", "6410:08", "6410:07"), MOTOR_FAN],
  heat_sink_pmm: [supervisor("3111", "3007")],
  heat_sink_pmc: [ofPmc("6510", "6510:06", "6510:02")],
};

/** Sensors in the order in which they are shown. */
export const SPOTS: readonly Spot[] = Object.entries(LANES).flatMap(([key, lanes]) => {
  const spot = TEMPERATURES.find((one) => one.key === key);
  return spot ? [{ spot, lanes }] : [];
});

/** All that the picture needs of a unit. */
export function addressesOf(on: Lane["on"]): string[] {
  const lanes = SPOTS.flatMap((one) => one.lanes).filter((lane) => lane.on === on);
  const found = lanes.flatMap((lane) =>
    lane.kind === "supervisor"
      ? [...lane.marks.map((mark) => mark.address), lane.status]
      : [
          lane.heater,
          lane.cooler,
          lane.hysteresis,
          ...lane.outputs.map((one) => one.address),
          lane.delay,
          lane.status,
        ],
  );
  return [...new Set(found.filter((one): one is string => one !== null))];
}

export type Look = (address: string) => number | null;
export type Name = (kind: MarkKind) => string;

/** Lower limit below warning below error: each stops one step before the next. */
export function limitBounds(lane: SupervisorLane, address: string, look: Look, name: Name): Bounds {
  const at = lane.marks.findIndex((one) => one.address === address);
  const neighbour = (mark: MarkAt | undefined): Neighbour | null =>
    mark === undefined ? null : { raw: look(mark.address), name: name(mark.kind), gap: 1 };
  return between(neighbour(lane.marks[at - 1]), neighbour(lane.marks[at + 1]));
}

/** Heating ends at its threshold plus the hysteresis, below where cooling begins. */
export function controlBounds(lane: ControllerLane, address: string, look: Look, name: Name): Bounds {
  const hysteresis = look(lane.hysteresis);
  if (lane.heater === null || hysteresis === null) return { low: null, high: null };
  const gap = Math.max(0, hysteresis) + 1;
  return address === lane.heater
    ? between(null, { raw: look(lane.cooler), name: name("cooler"), gap })
    : between({ raw: look(lane.heater), name: name("heater"), gap }, null);
}

/** A band at all, and not so wide that heating and cooling meet. */
export function hysteresisBounds(lane: ControllerLane, look: Look, name: Name): Bounds {
  const low = { raw: 1, other: null };
  const [heater, cooler] = [lane.heater === null ? null : look(lane.heater), look(lane.cooler)];
  if (heater === null || cooler === null) return { low, high: null };
  return { low, high: { raw: cooler - heater - 1, other: name("cooler") } };
}

/** A measurement, or null where the sensor says that there is none. */
export const measured = (raw: unknown): number | null =>
  typeof raw === "number" && raw !== SENSOR_OPEN && raw !== SENSOR_SHORT ? raw : null;

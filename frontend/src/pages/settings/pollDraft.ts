/** The polling list that is being edited: what it takes of a bus, and what is wrong with it. Pure. */
import type { PollBus, PollDevice, Polling, PollingChange } from "../../api/settings";

export type Rate = "fast" | "slow" | "rare";
export const RATES: readonly Rate[] = ["fast", "slow", "rare"];
/** Least and greatest of each number, as the server has them. */
export const LIMITS = {
  period_s: [0.05, 10],
  slow_every: [2, 1000],
  rare_every: [2, 1000],
  load_cap: [0.05, 0.9],
} as const;
export const MAX_ITEMS = 200;

export type Field = keyof typeof LIMITS;

export function changeOf(polling: Polling): PollingChange {
  return {
    period_s: polling.period_s,
    slow_every: polling.slow_every,
    rare_every: polling.rare_every,
    load_cap: polling.load_cap,
    devices: Object.fromEntries(
      polling.devices.map((device) => [
        device.description_id,
        Object.fromEntries(device.items.map((item) => [item.address, item.rate])),
      ]),
    ),
  };
}

export function perSecond(polling: Polling, rate: Rate): number {
  const every = { fast: 1, slow: polling.slow_every, rare: polling.rare_every }[rate];
  return 1 / (polling.period_s * every);
}

/** Share of the bus that polling takes, 0..1; above 1 it does not fit. Null where the bus has no bit rate. */
export function loadOf(polling: Polling, bus: PollBus): number | null {
  if (bus.bitrate === 0) return null;
  const bits = polling.devices.reduce(
    (sum, device) => sum + (bus.counts[device.description_id] ?? 0) * bitsOf(polling, device),
    0,
  );
  return bits / bus.bitrate;
}

function bitsOf(polling: Polling, device: PollDevice): number {
  return device.items.reduce((sum, item) => sum + item.bits * perSecond(polling, item.rate), 0);
}

export function outOfRange(polling: Polling): Field[] {
  return (Object.keys(LIMITS) as Field[]).filter((field) => {
    const [least, most] = LIMITS[field];
    const whole = field === "slow_every" || field === "rare_every";
    const number = polling[field];
    return !(number >= least && number <= most) || (whole && !Number.isInteger(number));
  });
}

/** The list as the program comes with it. */
export function usualDevice(device: PollDevice): PollDevice {
  return { ...device, items: device.usual };
}

export function isUsual(device: PollDevice): boolean {
  const rates = (items: PollDevice["items"]) =>
    items
      .map((item) => `${item.address} ${item.rate}`)
      .sort()
      .join();
  return rates(device.items) === rates(device.usual);
}

import { expect, it } from "vitest";
import type { SetRecord } from "../../../api/types";
import { choice, deviceChoices, foundChoices, grouped, keptOf } from "./choices";
import type { Source } from "./specs";

const NOW_MS = 1_700_000_000_000;
const DAY_MS = 86_400_000;
const WORDS = { source: (source: Source) => `is ${source}`, hint: () => "", none: "none yet" };
const DEVICES = ["w/b1/pmc", "w/b2/pmc"].map((slug) => ({ slug, name: slug, descriptionId: "oat-pmc" }));

const record = (device: string, tags: string[], daysAgo: number) =>
  ({
    origin: { device },
    description_id: "oat-pmc",
    tags: tags.map((tag) => ({ tag })),
    t_ns: (NOW_MS - daysAgo * DAY_MS) * 1e6,
  }) as unknown as SetRecord;

it("knows what of a device is kept: tags by device, golden by kind, a year ago by age", () => {
  const kept = keptOf([record("w/b1/pmc", ["as-found", "golden"], 200), record("w/b2/pmc", [], 100)], NOW_MS);
  expect([...kept]).toEqual([
    "found w/b1/pmc",
    "golden oat-pmc",
    "latest w/b1/pmc",
    "year w/b1/pmc",
    "latest w/b2/pmc",
  ]);
  const absent = deviceChoices(DEVICES, null, kept, WORDS).filter((one) => one.absent);
  expect(absent.map((one) => one.column)).toEqual([
    "left:w/b1/pmc",
    "delivered:w/b1/pmc",
    "found:w/b2/pmc",
    "left:w/b2/pmc",
    "delivered:w/b2/pmc",
    "year:w/b2/pmc",
  ]);
});

it("bars nothing while it does not know what there is, and puts the reference's device first", () => {
  const choices = deviceChoices(DEVICES, "w/b2/pmc", null, WORDS);
  expect(choices.some((one) => one.absent)).toBe(false);
  expect(choices[0]?.column).toBe("live:w/b2/pmc");
});

it("finds by every word, in group or label", () => {
  const choices = [choice("a", "now", "RAM", "Blade 1"), choice("b", "now", "RAM", "Blade 2")];
  expect(foundChoices(choices, "2 NOW").map((one) => one.column)).toEqual(["b"]);
  expect(grouped(choices).map(([name, members]) => [name, members.length])).toEqual([
    ["Blade 1", 1],
    ["Blade 2", 1],
  ]);
});

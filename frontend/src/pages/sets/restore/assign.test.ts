import { describe, expect, it } from "vitest";
import type { SetRecord } from "../../../api/types";
import type { DeviceRef } from "../../../api/types";
import { assign, exchange, others } from "./assign";

const device = (slug: string, kind: string) => ({ slug, description_id: kind }) as DeviceRef;
const record = (id: string, slug: string, kind: string) =>
  ({ id, description_id: kind, origin: { device: slug } }) as SetRecord;

const DEVICES = [device("w/b2/pmm", "oat-pmm"), device("w/b2/pmc", "oat-pmc")];
const RECORDS = [
  record("a", "w/b1/pmm", "oat-pmm"),
  record("b", "w/b2/pmm", "oat-pmm"),
  record("c", "w/b1/pmc", "oat-pmc"),
];

describe("which set goes where", () => {
  it("gives a set of another blade to the device of its kind", () => {
    const given = assign(DEVICES, RECORDS, ["a", "c"]);
    expect(given.map((one) => one.record?.id)).toEqual(["a", "c"]);
  });

  it("gives a device its own set before any other, and offers its own first", () => {
    const given = assign(DEVICES, RECORDS, ["a", "b"]);
    expect(given.map((one) => one.record?.id ?? null)).toEqual(["b", null]);
    expect(given[0]?.choices.map((one) => one.id)).toEqual(["b", "a"]);
  });

  it("keeps what is not in the library apart", () => {
    expect(others(RECORDS, ["motor:1@1:w/b2/pmc", "a"])).toEqual(["motor:1@1:w/b2/pmc"]);
  });

  it("exchanges the set of one device and leaves the others", () => {
    expect(exchange(["a", "c"], "a", "b")).toEqual(["c", "b"]);
    expect(exchange(["a", "c"], "c", null)).toEqual(["a"]);
    expect(exchange(["c"], null, "a")).toEqual(["c", "a"]);
  });
});

import { expect, it } from "vitest";
import { setRows } from "./rows";

it("sets beside what the device holds now: unknown differs from nothing, order is that of addresses", () => {
  const now: Record<string, number | string> = { "6065": 100, "3110:01": 490, "1008": "PMC" };
  const rows = setRows(
    { "6065": 100, "3110:01": 500, "1008": "PMC", "6067": 10 },
    (address) => now[address] ?? null,
  );
  expect(rows.map((row) => row.address)).toEqual(["1008", "3110:01", "6065", "6067"]);
  expect(rows.filter((row) => row.different)).toEqual([
    { address: "3110:01", raw: 500, now: 490, different: true },
  ]);
  expect(rows.at(-1)?.now).toBeNull();
});

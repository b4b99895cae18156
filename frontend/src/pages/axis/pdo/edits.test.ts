import { expect, test } from "vitest";
import type { Pdo, PdoSetup } from "../../../api/pdo";
import {
  allowsRemote,
  bitsOf,
  canIdOf,
  isEnabled,
  moved,
  parseCanId,
  pdoEdits,
  withCanId,
  withEnabled,
  withRemote,
} from "./edits";

const OFF: PdoSetup = {
  cob_id: 0xc000028b,
  transmission_type: 255,
  inhibit_100us: 0,
  event_ms: 0,
  sync_start: 0,
  mapped: [
    { object: "6041", bits: 16 },
    { object: "6064", bits: 32 },
  ],
};

test("the bits of a COB-ID are told apart, also those beyond 31", () => {
  expect([isEnabled(OFF), allowsRemote(OFF), canIdOf(OFF)]).toEqual([false, false, 0x28b]);
  expect(withEnabled(OFF, true).cob_id).toBe(0x4000028b);
  expect(withEnabled(withEnabled(OFF, true), false)).toEqual(OFF);
  expect(withRemote(OFF, true).cob_id).toBe(0x8000028b);
  expect(withCanId(OFF, 0x301).cob_id).toBe(0xc0000301);
  expect(withCanId(OFF, 0x12345).cob_id).toBe(0xe0012345);
  expect(canIdOf(withCanId(OFF, 0x12345))).toBe(0x12345);
  expect(withCanId(withCanId(OFF, 0x12345), 0x28b)).toEqual(OFF);
});

test("an identifier is read as it is written", () => {
  expect(["291", "291h", "0x291", " 0X291 "].map(parseCanId)).toEqual([0x291, 0x291, 0x291, 0x291]);
  expect(["", "h", "29G", "-1", "20000000"].map(parseCanId)).toEqual([null, null, null, null, null]);
});

test("entries change places and none is lost", () => {
  expect(moved(["a", "b", "c"], 0, 2)).toEqual(["b", "c", "a"]);
  expect(moved(["a", "b", "c"], 2, 0)).toEqual(["c", "a", "b"]);
  expect(moved(["a"], 5, 0)).toEqual(["a"]);
  expect(bitsOf(OFF)).toBe(48);
});

test("what stands there anyway is no edit, and the base of an edit stays", () => {
  const pdo = { direction: "tpdo", number: 2, setup: OFF } as Pdo;
  pdoEdits.want("one", pdo, withEnabled(OFF, true));
  const other = { ...pdo, setup: withCanId(OFF, 1) };
  pdoEdits.want("one", other, { ...OFF, event_ms: 7 });
  expect(pdoEdits.of("one").get("tpdo2")).toMatchObject({ base: OFF, wanted: { event_ms: 7 } });
  expect(pdoEdits.of("two").size).toBe(0);
  pdoEdits.want("one", other, OFF);
  expect(pdoEdits.of("one").size).toBe(0);
});

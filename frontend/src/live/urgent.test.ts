import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Asked } from "./asked";
import { Unreachable } from "../api/client";
import { byRequest, commandBy, GIVE_UP_MS, TAKEN_MS } from "./urgent";

const OVER_SOCKET = { axes: [] };
const BY_REQUEST = { axes: [] };
const STOP = { command: "stop" } as const;
const PRESS = { page: "p", number: 1 };

function asking(asked: Asked) {
  const [number, command] = asked.ask();
  return { press: { page: "p", number }, command };
}

describe("STOP", () => {
  beforeEach(() => {
    vi.useFakeTimers();
  });
  afterEach(() => {
    vi.useRealTimers();
  });

  it("goes over the socket, and no request is made of it", async () => {
    const asked = new Asked();
    const request = vi.fn();
    const answer = commandBy(() => asking(asked), STOP, request);
    asked.told({ number: 1, taken: true, done: null });
    await vi.advanceTimersByTimeAsync(10 * TAKEN_MS);
    asked.told({ number: 1, taken: true, done: OVER_SOCKET });
    expect(await answer).toBe(OVER_SOCKET);
    expect(request).not.toHaveBeenCalled();
  });

  it("is a request at once where the socket is not open", async () => {
    const request = vi.fn().mockResolvedValue(BY_REQUEST);
    expect(await commandBy(() => ({ press: PRESS, command: null }), STOP, request)).toBe(BY_REQUEST);
    expect(request).toHaveBeenCalledWith(STOP, PRESS);
  });

  it("is a request as well where the server says nothing, and the first answer counts", async () => {
    const asked = new Asked();
    const request = vi.fn().mockReturnValue(new Promise(() => undefined));
    const answer = commandBy(() => asking(asked), STOP, request);
    await vi.advanceTimersByTimeAsync(TAKEN_MS - 1);
    expect(request).not.toHaveBeenCalled();
    await vi.advanceTimersByTimeAsync(1);
    expect(request).toHaveBeenCalledTimes(1);
    expect(request).toHaveBeenCalledWith(STOP, PRESS);
    asked.told({ number: 1, taken: true, done: OVER_SOCKET });
    expect(await answer).toBe(OVER_SOCKET);
  });

  it("is a request where the socket is lost, or nothing is connected", async () => {
    for (const end of [
      (asked: Asked) => asked.lost(),
      (asked: Asked) => asked.told({ number: 1, taken: false, done: null }),
    ]) {
      const asked = new Asked();
      const request = vi.fn().mockResolvedValue(BY_REQUEST);
      const answer = commandBy(() => asking(asked), STOP, request);
      end(asked);
      expect(await answer).toBe(BY_REQUEST);
    }
  });

  it("says what the request says where both fail", async () => {
    const asked = new Asked();
    const request = vi.fn().mockRejectedValue(new Error("refused"));
    const answer = commandBy(() => asking(asked), STOP, request);
    asked.lost();
    await expect(answer).rejects.toThrow("refused");
  });

  it("that the server took and then failed at is a request", async () => {
    const asked = new Asked();
    const request = vi.fn().mockResolvedValue(BY_REQUEST);
    const answer = commandBy(() => asking(asked), STOP, request);
    asked.told({ number: 1, taken: true, done: null });
    asked.told({ number: 1, taken: false, done: null });
    expect(await answer).toBe(BY_REQUEST);
  });

  it("that was taken when the socket was lost is sent once more", async () => {
    const asked = new Asked();
    const request = vi.fn().mockResolvedValue(BY_REQUEST);
    const answer = commandBy(() => asking(asked), STOP, request);
    asked.told({ number: 1, taken: true, done: null });
    await vi.advanceTimersByTimeAsync(0);
    asked.lost();
    expect(await answer).toBe(BY_REQUEST);
  });

  it("that nobody answers is taken back, and its person is told", async () => {
    const asked: { url: string; signal: AbortSignal }[] = [];
    const hanging = (url: string, { signal }: { signal: AbortSignal }) =>
      new Promise((_, reject) => {
        asked.push({ url, signal });
        signal.addEventListener("abort", () => reject(new DOMException("aborted", "AbortError")));
      });
    vi.stubGlobal("fetch", hanging);
    vi.stubGlobal("location", { search: "" });
    for (const [urgent, url] of [
      [STOP, "/api/live/stop"],
      [{ command: "feather" }, "/api/live/feather"],
      [{ command: "stop", device: "t/b/pmc" }, "/api/live/devices/t/b/pmc/stop"],
    ] as const) {
      const answer = byRequest(urgent, PRESS);
      const told = expect(answer).rejects.toThrow(Unreachable);
      await vi.advanceTimersByTimeAsync(GIVE_UP_MS - 1);
      expect(asked.at(-1)).toMatchObject({ url, signal: { aborted: false } });
      await vi.advanceTimersByTimeAsync(1);
      await told;
    }
    vi.unstubAllGlobals();
  });
});

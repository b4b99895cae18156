/** Opens the recording that the URL names, hears of it, and opens it again where the server no longer knows it. */
import { useQuery } from "@tanstack/react-query";
import { createContext, useContext, useEffect, useEffectEvent, useMemo, useRef, useState } from "react";
import { Problem } from "../api/client";
import { openReplay, orderCursor, type ReplayDoc } from "../api/replay";
import { digitsOf } from "../api/trace";
import { usePageSearch } from "../frame/search";
import type { Channel } from "../live/channel";
import { openChannel } from "../live/live";
import { useTexts } from "../texts/texts";
import { notify } from "../ui/notices";
import { storyOf } from "../ui/problem";
import { Transport } from "./transport";

/** So long a cursor must stand before its place is in the URL. */
const STANDING_MS = 250;
/** Closer than this two places are the same: numbers of a browser hold no single nanoseconds. */
const SAME_NS = 1000;
const TRIES = 5;
const LATEST_NS = 2 ** 62;

export interface Replay {
  id: string;
  /** Undefined until it is open. */
  doc: ReplayDoc | undefined;
  /** Why it cannot be opened. */
  error: Error | null;
  again: () => void;
  transport: Transport;
  /** The moment of the link where others look at another one: theirs is not moved unasked. */
  offered: number | null;
  answerOffer: (taken: boolean) => void;
}

export const ReplayContext = createContext<Replay | null>(null);

/** The replay that the page shows, with its cursor's transport; null where it shows the bench. */
export const useReplay = (): Replay | null => useContext(ReplayContext);

export function useOpening(channel: Channel, id: string | undefined): Replay | null {
  const t = useTexts();
  const [search] = usePageSearch();
  const opened = useQuery({
    queryKey: ["replay", id, "open"],
    // It stands there from the first: a seek after it might undo what its person does meanwhile.
    queryFn: () => openReplay(id ?? "", placeOf(channel.store.cursor?.t_ns ?? Number(search.at ?? NaN))),
    enabled: id !== undefined,
    retry: (failures, error) => !(error instanceof Problem) && failures < TRIES,
    gcTime: 0,
  });
  const { data: doc, dataUpdatedAt, refetch } = opened;
  const tellFailed = useEffectEvent((error: unknown) => {
    const story = storyOf(error, t);
    notify({ tone: "error", title: t("page.replay.cursor_failed"), lines: [story.happened, story.next] });
  });
  const transport = useMemo(() => new Transport(id ?? ""), [id]);
  useEffect(() => transport.tell((error) => tellFailed(error)), [transport]);
  const [offered, setOffered] = useState<number | null>(null);
  const [settled, setSettled] = useState<string | null>(null);

  useEffect(() => {
    if (dataUpdatedAt === 0) return;
    return openChannel(channel, () => void refetch());
  }, [channel, dataUpdatedAt, refetch]);

  const linked = useEffectEvent(() => Number(search.at ?? NaN));
  useEffect(() => {
    if (doc === undefined) return;
    const told = (offer: number | null) => {
      setOffered(offer);
      setSettled(doc.id);
    };
    const settling = channel.store.cursor === null ? settle(doc, linked()) : Promise.resolve(null);
    settling.then(told, (error: unknown) => tellFailed(error));
    // Once for every time that it was opened.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [dataUpdatedAt]);

  useMomentInUrl(channel, id !== undefined && settled === id && offered === null);
  return useMemo(() => {
    if (id === undefined) return null;
    return {
      id,
      doc: doc?.id === id ? doc : undefined,
      error: doc === undefined ? opened.error : null,
      again: () => void refetch(),
      transport,
      offered,
      answerOffer: (taken) => {
        if (taken && offered !== null) transport.seek(offered);
        setOffered(null);
      },
    };
  }, [id, doc, opened.error, refetch, transport, offered]);
}

/** What can be a time of a recording; null where a link holds something else. */
const placeOf = (tNs: number): number | null => (tNs >= 0 && tNs <= LATEST_NS ? tNs : null);

/**
 * Puts the cursor where the link of a page that has just come points. Where others look at the replay already nothing is
 * moved: gives the place that the link names, to be offered.
 */
async function settle(doc: ReplayDoc, linkedNs: number): Promise<number | null> {
  if (!Number.isFinite(linkedNs) || Math.abs(linkedNs - doc.cursor.t_ns) < SAME_NS) return null;
  if (doc.watchers > 0) return linkedNs;
  if (doc.cursor.playing) await orderCursor(doc.id, { action: "pause" });
  await orderCursor(doc.id, { action: "seek", t_ns: Math.round(linkedNs) });
  return null;
}

/** Keeps the place of a cursor that stands still in the URL: any link is a moment that can be shared. */
function useMomentInUrl(channel: Channel, on: boolean): void {
  const [search, update] = usePageSearch();
  const written = useRef(search.at);
  const { at } = search;
  useEffect(() => {
    written.current = at;
  }, [at]);
  useEffect(() => {
    if (!on) return;
    const { store } = channel;
    let timer: ReturnType<typeof setTimeout> | undefined;
    const look = () => {
      const { cursor } = store;
      if (cursor === null) return;
      clearTimeout(timer);
      const moment = cursor.playing ? undefined : digitsOf(cursor.t_ns);
      if (moment === written.current) return;
      const write = () => update({ at: moment });
      if (cursor.playing) write();
      else timer = setTimeout(write, STANDING_MS);
    };
    const end = store.subscribe("cursor", look);
    look();
    return () => {
      end();
      clearTimeout(timer);
    };
  }, [channel, on, at, update]);
}

/** Reading the whole dictionary: one job a device at a time, kept beside the page so that changing rooms loses nothing. */
import { useMutation, useQuery } from "@tanstack/react-query";
import { useEffect, useMemo } from "react";
import { commands } from "../../api/client";
import { jobQuery, queryClient } from "../../api/queries";
import type { Job } from "../../api/types";
import { useShown } from "../../live/live";
import { type Translate, useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { storyOf } from "../../ui/problem";
import { useSilent } from "./silent";
import { useCoarseVersion } from "./versions";

const offered = new Set<string>();

export interface ReadAll {
  job: Job | undefined;
  running: boolean;
  /** Reads these addresses, or all where null. */
  start: (addresses: string[] | null) => void;
  cancel: () => void;
}

const runningKey = (slug: string) => ["reading", slug];

export function useReadAll(slug: string): ReadAll {
  const t = useTexts();
  const id = useQuery({
    queryKey: runningKey(slug),
    queryFn: () => null as string | null,
    staleTime: Infinity,
  }).data;
  const job = useQuery(jobQuery(id ?? null)).data;
  const failed = (error: unknown) => tellFailed(error, t);
  const start = useMutation({
    mutationFn: (addresses: string[] | null) => commands.read(slug, addresses),
    onSuccess: (begun) => remember(slug, begun),
    onError: failed,
  });
  const cancel = useMutation({ mutationFn: commands.cancel, onError: failed });
  return {
    job,
    running: start.isPending || job?.state === "running",
    start: start.mutate,
    cancel: () => {
      if (job) cancel.mutate(job.id);
    },
  };
}

/** Reads several devices completely, each in a job of its own that its hook shows. */
export function useReadMany(): (slugs: readonly string[]) => void {
  const t = useTexts();
  return (slugs) => {
    for (const slug of slugs) {
      commands.read(slug, null).then(
        (begun) => remember(slug, begun),
        (error: unknown) => tellFailed(error, t),
      );
    }
  };
}

function remember(slug: string, begun: Job): void {
  queryClient.setQueryData(["job", begun.id], begun);
  queryClient.setQueryData(runningKey(slug), begun.id);
}

function tellFailed(error: unknown, t: Translate): void {
  const story = storyOf(error, t);
  notify({ tone: "error", title: t("page.read.failed"), lines: [story.happened, story.next] });
}

/** The first time that a device without any known value is opened, it is read by itself. Never again after that. */
export function useReadAtFirstSight(slug: string, reading: ReadAll): void {
  const slugs = useMemo(() => [slug], [slug]);
  const heard = useCoarseVersion(slugs) > 0;
  const silent = useSilent(slug);
  const { store, recorded } = useShown();
  const { running, start } = reading;
  useEffect(() => {
    if (recorded || !heard || silent || running || offered.has(slug)) return;
    offered.add(slug);
    const known = [...(store.cells(slug)?.values() ?? [])].filter(
      (cell) => cell.known && cell.source === "sdo-read",
    );
    if (known.length === 0) start(null);
  }, [recorded, store, heard, silent, running, slug, start]);
}

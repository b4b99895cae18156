/** A write that runs: followed by its job until it ends, even over a reload of the page. */
import { useMutation, useQuery } from "@tanstack/react-query";
import { useEffect } from "react";
import { commands, Problem } from "../../api/client";
import { jobQuery, queryClient } from "../../api/queries";
import type { Job, WritesRequest } from "../../api/types";
import type { Change } from "../../model/staged";
import { useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { storyOf } from "../../ui/problem";
import { staged, useStaged } from "./staging";

export interface Order {
  changes: readonly Change[];
  save: string[];
  onFailure: WritesRequest["on_failure"];
  /** Rules that hold at every step may be broken where they are in the end. */
  accepted: boolean;
  /** The devices' network addresses may change: a person knows that the connection will be lost. */
  addressConfirmed: boolean;
}

export interface Writing {
  job: Job | undefined;
  running: boolean;
}

export function useWriting(): Writing {
  const { writing } = useStaged();
  const job = useQuery(jobQuery(writing?.job ?? null)).data;
  return { job, running: writing !== null };
}

/** Takes the outcome of a job into the pending changes. Once on the page. */
export function useFinishWriting(): void {
  const t = useTexts();
  const { writing } = useStaged();
  const { data: job, error } = useQuery(jobQuery(writing?.job ?? null));
  useEffect(() => {
    if (job && job.state !== "running") staged.finish(job);
  }, [job]);
  useEffect(() => {
    // The bench was started anew: what became of the rows only the devices know.
    if (!(error instanceof Problem) || error.doc.status !== 404) return;
    staged.forgetJob();
    notify({ tone: "warning", title: t("page.review.lost"), lines: [t("page.review.lost_next")] });
  }, [error, t]);
}

export function useWrite() {
  const t = useTexts();
  return useMutation({
    mutationFn: ({ changes, save, onFailure, accepted, addressConfirmed }: Order) =>
      commands.writes({
        rows: changes.map(({ device, address, raw, from }) => ({ device, address, raw, expected_raw: from })),
        save,
        on_failure: onFailure,
        accepted,
        address_confirmed: addressConfirmed,
      }),
    onSuccess: (job, { changes }) => {
      queryClient.setQueryData(["job", job.id], job);
      staged.begin(job.id, changes);
    },
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.review.failed"), lines: [story.happened, story.next] });
    },
  });
}

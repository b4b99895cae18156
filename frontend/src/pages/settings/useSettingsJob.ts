/** Work on an adapter that was started from here: its latest state, until another one is started. */
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { commands } from "../../api/client";
import { queryClient } from "../../api/queries";
import { type SettingsJob, settingsJobQuery } from "../../api/settings";

export interface StartedJob {
  job: SettingsJob | undefined;
  running: boolean;
  /** Why it could not be started, or watched. */
  error: unknown;
  start: (begin: () => Promise<SettingsJob>) => void;
  cancel: () => void;
  clear: () => void;
}

export function useSettingsJob(): StartedJob {
  const [id, setId] = useState<string | null>(null);
  const watched = useQuery(settingsJobQuery(id));
  const begin = useMutation({
    mutationFn: (begin: () => Promise<SettingsJob>) => begin(),
    onSuccess: (begun) => {
      queryClient.setQueryData(settingsJobQuery(begun.id).queryKey, begun);
      setId(begun.id);
    },
  });
  const cancel = useMutation({ mutationFn: commands.cancel });
  const job = id === null ? undefined : watched.data;
  return {
    job,
    running: begin.isPending || job?.state === "running",
    error: begin.error ?? watched.error ?? cancel.error,
    start: (work) => {
      setId(null);
      begin.mutate(work);
    },
    cancel: () => {
      if (job) cancel.mutate(job.id);
    },
    clear: () => {
      setId(null);
      begin.reset();
    },
  };
}

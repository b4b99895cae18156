/** Recordings of the data folder. Their list is asked again while files were not read yet, or one grows. */
import { queryOptions } from "@tanstack/react-query";
import { get } from "./client";
import type { RecordingDoc, RecordingList } from "./types";

const FILLING_MS = 700;
const GROWING_MS = 10_000;

export const recordingsQuery = queryOptions({
  queryKey: ["recordings"],
  queryFn: ({ signal }) => get<RecordingList>("/api/recordings", signal),
  staleTime: 0,
  refetchInterval: (query) =>
    query.state.data?.files.some((file) => file.state === "unread") ? FILLING_MS : GROWING_MS,
});

const recordingPath = (name: string) => `/api/recordings/${encodeURIComponent(name)}`;

export const recordingQuery = (name: string | undefined) =>
  queryOptions({
    queryKey: ["recording", name],
    queryFn: ({ signal }) => get<RecordingDoc>(recordingPath(name ?? ""), signal),
    enabled: name !== undefined,
    staleTime: 0,
  });

export const recordingDownload = (name: string) => `${recordingPath(name)}/download`;
export const attachmentDownload = (name: string, attachment: string) =>
  `${recordingPath(name)}/attachment?attachment=${encodeURIComponent(attachment)}`;

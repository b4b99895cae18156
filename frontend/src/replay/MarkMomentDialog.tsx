import { Checkbox, SegmentedControl } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { annotations, incidentKeys, incidents, type Severity } from "../api/incidents";
import { queryClient } from "../api/queries";
import type { ReplayDoc } from "../api/replay";
import { usePageSearch } from "../frame/search";
import { useStore } from "../live/live";
import type { DeskSignal } from "../pages/recordings/desk/signals";
import { useSignals } from "../pages/recordings/desk/signals";
import { usePlots } from "../pages/recordings/desk/usePlots";
import { useTexts } from "../texts/texts";
import { copyText } from "../ui/copyText";
import { notify } from "../ui/notices";
import { Note } from "./MarkMomentNote";
import { MarkMomentFrame } from "./MarkMomentFrame";
import { Range, stretchOf, TitleAndNotes, type Written, writtenOf } from "./MarkMomentForm";

const AROUND_NS = 10e9;
const NO_SIGNALS: ReadonlyMap<string, DeskSignal> = new Map();
const KINDS = ["incident", "annotation"] as const;
type Kind = (typeof KINDS)[number];

interface Props {
  doc: ReplayDoc;
  onClose: () => void;
}

/** Writes down what is to be seen now: as an incident with a short link, or as a plain note at the recording. */
export function MarkMomentDialog({ doc, onClose }: Props) {
  const t = useTexts();
  const kept = useKept(doc);
  const [kind, setKind] = useState<Kind>("incident");
  const [written, setWritten] = useState<Written>(kept.first);
  const [severity, setSeverity] = useState<Severity>("warning");
  const [withPlots, setWithPlots] = useState(true);
  const [withLoop, setWithLoop] = useState(true);
  const told = useTold(onClose);
  const stretch = stretchOf(written, kept.atNs, kind === "annotation");
  const keeping = useMutation({
    mutationFn: async () => {
      if (stretch === null) return;
      const { title, notes, tags } = written;
      if (kind === "annotation") {
        await annotations.add(doc.recording, { ...stretch, text: title, severity });
        told.noted(title);
        return;
      }
      const plots = withPlots ? kept.plots : [];
      const loop = withLoop ? kept.loop : null;
      const words = { ...stretch, at_ns: kept.atNs, title, notes, tags, plots, camera: kept.camera, loop };
      const made = await incidents.keep(doc.recording, words);
      told.marked(made.title, new URL(made.link, location.href).href);
    },
    onSuccess: () => queryClient.invalidateQueries(incidentKeys),
  });
  const change = (part: Partial<Written>) => setWritten((before) => ({ ...before, ...part }));
  return (
    <MarkMomentFrame
      title={t("page.mark.dialog")}
      name="mark"
      keep={t(`page.mark.keep.${kind}`)}
      ready={stretch !== null && written.title.trim() !== ""}
      keeping={keeping}
      onClose={onClose}
    >
      <SegmentedControl
        value={kind}
        onChange={setKind}
        data={KINDS.map((value) => ({ value, label: t(`page.mark.kind.${value}`) }))}
        aria-label={t("page.mark.kind_label")}
        data-testid="mark-kind"
      />
      {kind === "incident" ? (
        <TitleAndNotes written={written} onChange={change} />
      ) : (
        <Note
          text={written.title}
          severity={severity}
          onText={(title) => change({ title })}
          onSeverity={setSeverity}
        />
      )}
      <Range atNs={kept.atNs} written={written} onChange={change} point={kind === "annotation"} />
      {kind === "incident" && (
        <>
          <Checkbox
            label={t("page.mark.plots", { count: kept.plots.length })}
            checked={withPlots && kept.plots.length > 0}
            disabled={kept.plots.length === 0}
            onChange={(event) => setWithPlots(event.currentTarget.checked)}
          />
          {kept.loop !== null && (
            <Checkbox
              label={t("page.mark.loop")}
              checked={withLoop}
              onChange={(event) => setWithLoop(event.currentTarget.checked)}
            />
          )}
        </>
      )}
    </MarkMomentFrame>
  );
}

/** What is to be seen at this moment: the loop that it lies in or some seconds around it, the plots, the camera. */
function useKept(doc: ReplayDoc) {
  const store = useStore();
  const [search] = usePageSearch();
  const [{ atNs, loop }] = useState(() => {
    const cursor = store.cursor ?? doc.cursor;
    return { atNs: cursor.t_ns, loop: cursor.loop ?? null };
  });
  const inLoop = loop !== null && loop.from_ns <= atNs && atNs <= loop.to_ns;
  const around = {
    from_ns: Math.max(doc.from_ns, atNs - AROUND_NS),
    to_ns: Math.min(doc.to_ns, atNs + AROUND_NS),
  };
  const { from_ns, to_ns } = inLoop ? loop : around;
  const first = writtenOf({ from_ns, to_ns, at_ns: atNs, title: "", notes: "", tags: [] });
  const signals = useSignals(doc.id) ?? NO_SIGNALS;
  const plots = usePlots(signals)
    .list.map((plot) =>
      plot.signals.flatMap((name) => {
        const line = signals.get(name)?.line;
        return line ? [`${line.device}/${line.address}`] : [];
      }),
    )
    .filter((plot) => plot.length > 0);
  return { atNs, loop, first, plots, camera: search.camera ?? "" };
}

/** Tells what was kept, with its link to give away. */
function useTold(onClose: () => void) {
  const t = useTexts();
  return {
    noted: (text: string) => {
      notify({ tone: "ok", title: t("page.mark.noted"), lines: [text] });
      onClose();
    },
    marked: (title: string, link: string) => {
      const run = () => copyText(link, t);
      notify({
        tone: "ok",
        title: t("page.mark.marked", { title }),
        lines: [link],
        action: { label: t("page.mark.copy_link"), run },
      });
      onClose();
    },
  };
}

import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { type Incident, incidentKeys, incidents } from "../../../api/incidents";
import { queryClient } from "../../../api/queries";
import { Range, stretchOf, TitleAndNotes, type Written, writtenOf } from "../../../replay/MarkMomentForm";
import { MarkMomentFrame } from "../../../replay/MarkMomentFrame";
import { useTexts } from "../../../texts/texts";

interface Props {
  incident: Incident;
  onClose: () => void;
}

/** Keeps another version; where somebody else was faster, that is said and nothing is kept. */
export function EditIncident({ incident, onClose }: Props) {
  const t = useTexts();
  const [first] = useState(incident);
  const [written, setWritten] = useState<Written>(() => writtenOf(first));
  const stretch = stretchOf(written, first.at_ns);
  const keeping = useMutation({
    mutationFn: async () => {
      if (stretch === null) return;
      const { title, notes, tags } = written;
      const { at_ns, plots, camera, loop } = first;
      const words = { ...stretch, at_ns, title, notes, tags, plots, camera, loop };
      await incidents.change(first.code, first.version, words);
      onClose();
    },
    onSuccess: () => queryClient.invalidateQueries(incidentKeys),
  });
  const change = (part: Partial<Written>) => setWritten((before) => ({ ...before, ...part }));
  return (
    <MarkMomentFrame
      title={t("page.incidents.edit_title")}
      name="edit"
      keep={t("page.incidents.keep")}
      ready={stretch !== null && written.title.trim() !== ""}
      keeping={keeping}
      onClose={onClose}
    >
      <TitleAndNotes written={written} onChange={change} />
      <Range atNs={first.at_ns} written={written} onChange={change} />
    </MarkMomentFrame>
  );
}

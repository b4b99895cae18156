import { Select, TextInput } from "@mantine/core";
import { SEVERITIES, type Severity } from "../api/incidents";
import { useTexts } from "../texts/texts";

interface NoteProps {
  text: string;
  severity: Severity;
  onText: (text: string) => void;
  onSeverity: (severity: Severity) => void;
}

/** A plain note: its text and how much it matters. */
export function Note({ text, severity, onText, onSeverity }: NoteProps) {
  const t = useTexts();
  return (
    <>
      <TextInput
        label={t("page.mark.text")}
        value={text}
        onChange={(event) => onText(event.currentTarget.value)}
        required
        data-autofocus
        data-testid="note-text"
      />
      <Select
        label={t("page.mark.severity_label")}
        value={severity}
        onChange={(value) => onSeverity(SEVERITIES.find((one) => one === value) ?? "info")}
        data={SEVERITIES.map((value) => ({ value, label: t(`page.mark.severity.${value}`) }))}
        allowDeselect={false}
      />
    </>
  );
}

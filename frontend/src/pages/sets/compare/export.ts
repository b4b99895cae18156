import { exportComparison, type ExportFormat, type Pending } from "../../../api/compare";
import { useTexts } from "../../../texts/texts";
import { downloadBlob } from "../../../ui/export";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";
import { Rows } from "./lines";

/** The comparison as a file, made by the server: whatever is filtered here. */
export function useExport(
  columns: readonly string[],
  pending: Pending,
  rows: Rows,
): (format: ExportFormat) => void {
  const t = useTexts();
  return (format) => {
    exportComparison(format, columns, pending, rows === Rows.All, t.language)
      .then((file) => downloadBlob(`hubside-comparison.${format}`, file))
      .catch((error: unknown) => {
        const story = storyOf(error, t);
        notify({
          tone: "error",
          title: t("page.compare.export.failed"),
          lines: [story.happened, story.next],
        });
      });
  };
}

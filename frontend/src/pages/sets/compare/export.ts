import { exportComparison, type ExportFormat, type Pending } from "../../../api/compare";
import { useTexts } from "../../../texts/texts";
import { downloadBlob } from "../../../ui/export";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";

/** The comparison as a file, made by the server: all rows, whatever is filtered here. */
export function useExport(columns: readonly string[], pending: Pending): (format: ExportFormat) => void {
  const t = useTexts();
  return (format) => {
    exportComparison(format, columns, pending)
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

import { library } from "../../../api/sets";
import { queryClient } from "../../../api/queries";
import { useTexts } from "../../../texts/texts";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";
import { deviceOf, ofDevice, Source } from "./specs";

/** A file goes into the library and from there into a column. What does not say whose it is, is taken for the reference's. */
export function useUpload(
  reference: string | null,
  kind: string | null,
  onColumn: (column: string) => void,
): (file: File) => Promise<void> {
  const t = useTexts();
  return async (file) => {
    try {
      const device = reference === null ? null : deviceOf(reference);
      const taken = await library.importFile({
        name: file.name,
        data: await base64Of(file),
        device,
        description_id: kind,
        as_values: false,
        reason: "",
      });
      void queryClient.invalidateQueries({ queryKey: ["sets"] });
      onColumn(ofDevice(Source.Set, taken.record.id));
    } catch (error) {
      const story = storyOf(error, t);
      notify({
        tone: "error",
        title: t("page.compare.picker.failed", { file: file.name }),
        lines: [story.happened, story.next],
      });
    }
  };
}

async function base64Of(file: File): Promise<string> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text);
}

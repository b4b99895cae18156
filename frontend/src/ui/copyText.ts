import type { Translate } from "../texts/texts";
import { notify } from "./notices";

/** Puts a text into the clipboard and tells of it; where that is not allowed it tells the text, to be copied by hand. */
export function copyText(text: string, t: Translate): void {
  // Pages that did not come by https from elsewhere have no clipboard.
  const copying = window.isSecureContext ? navigator.clipboard.writeText(text) : Promise.reject(new Error());
  copying.then(
    () => notify({ tone: "ok", title: t("page.copied"), lines: [text] }),
    () => notify({ tone: "warning", title: t("page.copy_failed"), lines: [text] }),
  );
}

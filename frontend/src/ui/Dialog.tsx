import { Modal, type ModalProps } from "@mantine/core";
import { useTexts } from "../texts/texts";

/** A modal dialog whose cross has a name. */
export function Dialog(props: ModalProps) {
  const t = useTexts();
  return <Modal closeButtonProps={{ "aria-label": t("page.close") }} {...props} />;
}

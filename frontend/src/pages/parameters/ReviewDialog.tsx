import { Text } from "@mantine/core";
import { useTexts } from "../../texts/texts";
import type { Place } from "../../ui/devices";
import { ReviewList } from "./ReviewList";
import { useStaged } from "./staging";
import { Outcome, Progress } from "./WriteProgress";
import { staged } from "./staging";
import { Dialog } from "../../ui/Dialog";

interface Props {
  places: readonly Place[];
  onClose: () => void;
}

/** One review for all that is pending; then the same dialog shows how far each row is, and what became of it. */
export function ReviewDialog({ places, onClose }: Props) {
  const t = useTexts();
  const { writing, outcome } = useStaged();
  const stepName = writing !== null ? "running" : outcome !== null ? "ended" : "review";
  const close = () => {
    if (writing === null) staged.dismiss();
    onClose();
  };
  return (
    <Dialog
      opened
      onClose={close}
      closeOnClickOutside={false}
      size={860}
      title={<Text fw={700}>{t(`page.review.title.${stepName}`)}</Text>}
      data-testid="review-dialog"
    >
      {writing !== null && <Progress writing={writing} places={places} onClose={close} />}
      {writing === null && outcome !== null && (
        <Outcome outcome={outcome} places={places} onClose={close} onRest={() => staged.dismiss()} />
      )}
      {writing === null && outcome === null && <ReviewList places={places} onClose={close} />}
    </Dialog>
  );
}

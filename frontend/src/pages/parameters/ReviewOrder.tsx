import { Alert, Checkbox, Text } from "@mantine/core";
import { IconAlertTriangle, IconListNumbers } from "@tabler/icons-react";
import type { WritesPlan } from "../../api/writes";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import classes from "./Parameters.module.css";

interface Props {
  plan: WritesPlan | undefined;
  accepted: boolean;
  onAccept: (accepted: boolean) => void;
}

/**
 * In which order the rows go, and for which of them there is none in which all rules hold that must at every step. A
 * person may accept what is broken in the end; before that nothing is sent.
 */
export function ReviewOrder({ plan, accepted, onAccept }: Props) {
  const t = useTexts();
  const none = (plan?.unordered.length ?? 0) > 0;
  const unknown = plan?.unknown.length ?? 0;
  // Its place is kept before the order is known: the button below must not move away from the pointer.
  return (
    <section className={classes.order} data-known={plan !== undefined} data-testid="review-order">
      {!none && (
        <Text size="sm" className="dim" data-testid={unknown > 0 ? "order-unknown" : undefined}>
          <IconListNumbers size={16} className={classes.inText} aria-hidden />{" "}
          {unknown > 0 ? t("page.review.order.unknown", { count: unknown }) : t("page.review.order.numbered")}
        </Text>
      )}
      {plan && none && <NoOrder plan={plan} />}
      {(accepted || (plan?.broken.length ?? 0) > 0) && (
        <Checkbox
          mt="xs"
          label={t("page.review.order.accept")}
          checked={accepted}
          onChange={(event) => onAccept(event.currentTarget.checked)}
          data-testid="order-accept"
        />
      )}
    </section>
  );
}

function NoOrder({ plan }: { plan: WritesPlan }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const rules = [...new Set(plan.broken.map((one) => t(`rule.${one.rule}.title`)))];
  const places = plan.unordered.map(({ device, address }) => `${nameOf(device)} ${address}`);
  return (
    <Alert
      color="red"
      variant="light"
      p="sm"
      icon={<IconAlertTriangle aria-hidden />}
      title={t("page.review.order.none")}
      data-testid="order-none"
    >
      <div>{t("page.review.order.places", { places: places.join(", ") })}</div>
      {rules.length > 0 && <div>{t("page.review.order.rules", { rules: rules.join("; ") })}</div>}
    </Alert>
  );
}

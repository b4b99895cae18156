import { Alert } from "@mantine/core";
import { useTexts } from "../texts/texts";
import { ProblemAlert } from "../ui/ProblemAlert";
import { NotHolding } from "./useOrder";

/** Why an order was not carried out; nothing where it was. */
export function OrderProblem({ error, title }: { error: unknown; title: string }) {
  const t = useTexts();
  if (error === null) return null;
  if (!(error instanceof NotHolding)) return <ProblemAlert error={error} title={title} />;
  return (
    <Alert color="red" variant="light" title={title} data-testid="problem">
      {t("page.motion.cannot_hold")}
    </Alert>
  );
}

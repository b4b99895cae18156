import { Alert, Text } from "@mantine/core";
import { IconAlertOctagon } from "@tabler/icons-react";
import { useTexts } from "../texts/texts";
import { storyOf } from "./problem";

/** An error as the operator needs it; the codes are in the details. */
export function ProblemAlert({ error, title }: { error: unknown; title: string }) {
  const t = useTexts();
  const story = storyOf(error, t);
  return (
    <Alert
      color="red"
      variant="light"
      title={title}
      icon={<IconAlertOctagon aria-hidden />}
      data-testid="problem"
    >
      <Text size="sm">{story.happened}</Text>
      {story.state !== null && <Text size="sm">{t("page.problem.state", { state: story.state })}</Text>}
      <Text size="sm" fw={600}>
        {story.next}
      </Text>
      {story.details.length > 0 && (
        <details>
          <summary style={{ cursor: "pointer", paddingTop: 6 }}>{t("page.problem.details")}</summary>
          <dl
            style={{ display: "grid", gridTemplateColumns: "auto 1fr", gap: "2px 12px", margin: "6px 0 0" }}
          >
            {story.details.map(([name, detail]) => (
              <Detail key={name} name={name} detail={detail} />
            ))}
          </dl>
        </details>
      )}
    </Alert>
  );
}

function Detail({ name, detail }: { name: string; detail: string }) {
  return (
    <>
      <dt className="dim">{name}</dt>
      <dd style={{ margin: 0, overflowWrap: "anywhere" }}>{detail}</dd>
    </>
  );
}

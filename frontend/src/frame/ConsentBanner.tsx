import { useMutation } from "@tanstack/react-query";
import { IconEar } from "@tabler/icons-react";
import { commands } from "../api/client";
import { useHearing, useOfLink } from "../live/live";
import { useTexts } from "../texts/texts";
import { HoldButton } from "../ui/HoldButton";
import { notify } from "../ui/notices";
import { storyOf } from "../ui/problem";
import classes from "./ConsentBanner.module.css";

/** While another master is on the bus nothing is sent until a person, who has asked its operator, says so. */
export function ConsentBanner() {
  const t = useTexts();
  const wanted = useOfLink((link) =>
    link?.needs_consent ? { bus: link.bus, signs: link.other_masters.map((master) => master.sign) } : null,
  );
  const hearing = useHearing().state === "hearing";
  const consent = useMutation({
    mutationFn: commands.consent,
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.consent.failed"), lines: [story.happened, story.next] });
    },
  });
  if (!hearing || wanted === null) return null;
  const seen = [...new Set(wanted.signs)].join(", ");
  return (
    <div className={classes.banner} role="alert" data-testid="consent">
      <IconEar size={22} aria-hidden />
      <div>
        <strong>{t("page.consent.title", { bus: wanted.bus, seen })}</strong>
        <span>{t("page.consent.explain")}</span>
      </div>
      <HoldButton
        tone="accent"
        hint={t("page.consent.hint")}
        disabled={consent.isPending}
        onHeld={consent.mutate}
        testId="consent-hold"
      >
        {t("page.consent.button")}
      </HoldButton>
    </div>
  );
}

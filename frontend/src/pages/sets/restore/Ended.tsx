import { Button } from "@mantine/core";
import {
  IconAlertOctagon,
  IconArrowBackUp,
  IconCircleCheck,
  IconFileCertificate,
  IconFileTypePdf,
  IconHistory,
  IconJson,
} from "@tabler/icons-react";
import { recordPath, type RestoreDoc } from "../../../api/restore";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { HoldButton } from "../../../ui/HoldButton";
import { dayAndTime } from "../../../ui/format";
import { useStationName } from "./names";
import { Cause } from "./RestoreRun";
import classes from "./Restore.module.css";
import { useWay } from "./ways";

const LOOKS = {
  new: { Icon: IconCircleCheck, tone: "tone-ok" },
  old: { Icon: IconArrowBackUp, tone: "tone-warning" },
  incomplete: { Icon: IconAlertOctagon, tone: "tone-error" },
} as const;

/** How it ended, what that means for the blade, and what can be done now. */
export function Ended({ doc }: { doc: RestoreDoc }) {
  const t = useTexts();
  const station = useStationName()(doc.station);
  if (doc.end === null) return null;
  const { Icon, tone } = LOOKS[doc.end];
  const proof = doc.end === "new" ? (doc.proven ? "proven" : "unproven") : null;
  return (
    <div className={classes.state} data-testid={`restore-end-${doc.end}`}>
      <div>
        <h1 role="status" className={tone} data-testid="restore-state">
          <Icon size={24} aria-hidden />
          {t(`page.restoring.end.${doc.end}`, { station })}
        </h1>
        <p>{t(`page.restoring.end_means.${proof ?? doc.end}`, { station })}</p>
        {doc.end !== "new" && <Cause doc={doc} />}
        <p className="dim">{ranBy(doc, t)}</p>
      </div>
      {doc.end === "incomplete" ? <WaysOut doc={doc} /> : <Links doc={doc} />}
    </div>
  );
}

function ranBy(doc: RestoreDoc, t: ReturnType<typeof useTexts>): string {
  const parts = [
    t("page.restoring.by", { person: doc.person, time: dayAndTime(doc.started_ns / 1e6) }),
    doc.work_order,
    doc.reason,
  ];
  return parts.filter((part) => part !== "").join(" · ");
}

/** On to the new values or back to the old ones: one of the two must be done before anything moves again. */
export function WaysOut({ doc }: { doc: Pick<RestoreDoc, "id"> }) {
  const t = useTexts();
  const way = useWay(doc);
  return (
    <NeedsRole role="technician">
      {(locked) => (
        <div className={classes.buttons}>
          <HoldButton
            tone="danger"
            hint={t("page.hold")}
            disabled={locked || way.isPending}
            onHeld={() => way.mutate("roll-back")}
            testId="roll-back-hold"
          >
            {t("page.restoring.roll_back")}
          </HoldButton>
          <HoldButton
            tone="accent"
            hint={t("page.hold")}
            disabled={locked || way.isPending}
            onHeld={() => way.mutate("resume")}
            testId="resume-hold"
          >
            {t("page.restoring.resume")}
          </HoldButton>
        </div>
      )}
    </NeedsRole>
  );
}

function Links({ doc }: { doc: RestoreDoc }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const undo = Object.values(doc.undo);
  return (
    <div className={classes.links}>
      <Button
        component="a"
        variant="default"
        href={recordPath(doc.id, "html", t.language)}
        download
        leftSection={<IconFileCertificate size={17} aria-hidden />}
        data-testid="record-html"
      >
        {t("page.restoring.record.html")}
      </Button>
      <Button
        component="a"
        variant="default"
        href={recordPath(doc.id, "pdf", t.language)}
        download
        leftSection={<IconFileTypePdf size={17} aria-hidden />}
        data-testid="record-pdf"
      >
        {t("page.restoring.record.pdf")}
      </Button>
      <Button
        component="a"
        variant="default"
        href={recordPath(doc.id, "json", t.language)}
        download
        leftSection={<IconJson size={17} aria-hidden />}
        data-testid="record-json"
      >
        {t("page.restoring.record.json")}
      </Button>
      {doc.end === "new" && undo.length > 0 && (
        <Button
          variant="default"
          leftSection={<IconArrowBackUp size={17} aria-hidden />}
          onClick={() =>
            update({
              restore: undefined,
              station: doc.station,
              sets: undo.join(","),
              select: undefined,
              rows: undefined,
            })
          }
          data-testid="restore-undo"
        >
          {t("page.restoring.undo")}
        </Button>
      )}
      <Button
        variant="default"
        leftSection={<IconHistory size={17} aria-hidden />}
        onClick={() => update({ restore: undefined, sets: undefined, select: undefined, rows: undefined })}
        data-testid="restore-close"
      >
        {t("page.restoring.to_all")}
      </Button>
    </div>
  );
}

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
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { dayAndTime } from "../../../ui/format";
import { useStationName } from "./names";
import { Cause } from "./RestoreRun";
import classes from "./Restore.module.css";
import { WaysOut } from "./Decision";
import { GiveUp } from "./GiveUp";

const LOOKS = {
  new: { Icon: IconCircleCheck, tone: "tone-ok" },
  old: { Icon: IconArrowBackUp, tone: "tone-warning" },
  incomplete: { Icon: IconAlertOctagon, tone: "tone-error" },
  "given-up": { Icon: IconAlertOctagon, tone: "tone-warning" },
} as const;

const RECORDS = [
  { format: "html", Icon: IconFileCertificate },
  { format: "pdf", Icon: IconFileTypePdf },
  { format: "json", Icon: IconJson },
] as const;

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
      {doc.end === "incomplete" ? (
        <div className={classes.waysOut}>
          <WaysOut doc={doc} />
          <GiveUp doc={doc} station={station} />
        </div>
      ) : (
        <Links doc={doc} />
      )}
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

function Links({ doc }: { doc: RestoreDoc }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const undo = Object.values(doc.undo);
  return (
    <div className={classes.links}>
      {RECORDS.map(({ format, Icon }) => (
        <Button
          key={format}
          component="a"
          variant="default"
          href={recordPath(doc.id, format, t.language)}
          download
          leftSection={<Icon size={17} aria-hidden />}
          data-testid={`record-${format}`}
        >
          {t(`page.restoring.record.${format}`)}
        </Button>
      ))}
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

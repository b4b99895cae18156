import { Alert, Button, Progress } from "@mantine/core";
import { IconAlertTriangle, IconChevronDown, IconClockOff, IconRefresh } from "@tabler/icons-react";
import { useMemo } from "react";
import type { EntryDoc, Job } from "../../api/types";
import { useNodes, useServerNow, useShown } from "../../live/live";
import type { Cell } from "../../live/store";
import { useTexts } from "../../texts/texts";
import { age } from "../../ui/format";
import { heartbeatOf } from "../overview/nodes";
import { rawOf } from "./cellValue";
import { useDevice } from "./context";
import classes from "./Parameters.module.css";
import { type ReadAll, useReadAll, useReadAtFirstSight } from "./readAll";
import { useSilent } from "./silent";
import { useCoarseVersion } from "./versions";

/** One line between tools and table: how far a reading is, or what is missing and the next step. */
export function StateLine({ slug, name }: { slug: string; name: string | null }) {
  const reading = useReadAll(slug);
  useReadAtFirstSight(slug, reading);
  const silent = useSilent(slug);
  if (reading.running)
    return (
      <Reading
        name={name}
        done={reading.job?.done ?? 0}
        total={reading.job?.total ?? 0}
        cancel={reading.cancel}
      />
    );
  if (silent) return <Silent slug={slug} name={name} />;
  return (
    <>
      <Failures job={reading.job} name={name} />
      <Missing slug={slug} reading={reading} name={name} />
    </>
  );
}

/** Begins a line with the device where several are shown. */
const of = (name: string | null, text: string): string => (name === null ? text : `${name}: ${text}`);

/** What the last reading could not get, and why. */
function Failures({ job, name }: { job: Job | undefined; name: string | null }) {
  const t = useTexts();
  if (!job || (job.failed.length === 0 && !job.error)) return null;
  const reasons = [...(job.error ? [job.error] : []), ...job.failed];
  const title = job.error ? t("page.read.failed") : t("page.read.some_failed", { count: job.failed.length });
  return (
    <details className={classes.failures} data-testid="read-failures">
      <summary>
        <IconAlertTriangle size={17} aria-hidden /> {of(name, title)}{" "}
        <IconChevronDown size={17} aria-hidden />
      </summary>
      <ul>
        {reasons.map((failure) => (
          <li key={failure.address}>
            <b>{failure.address}</b> {t(failure.text_key, failure.details)}
          </li>
        ))}
      </ul>
    </details>
  );
}

interface ReadingProps {
  name: string | null;
  done: number;
  total: number;
  cancel: () => void;
}

function Reading({ name, done, total, cancel }: ReadingProps) {
  const t = useTexts();
  const label = of(name, t("page.read.progress", { done, total }));
  return (
    <div className={classes.reading} role="status" data-testid="read-progress">
      <span>{label}</span>
      <Progress value={total === 0 ? 0 : (100 * done) / total} aria-label={label} flex={1} />
      <Button variant="default" onClick={cancel}>
        {t("page.cancel")}
      </Button>
    </div>
  );
}

function Silent({ slug, name }: { slug: string; name: string | null }) {
  const t = useTexts();
  const nowMs = useServerNow(500);
  const { ageMs } = heartbeatOf(useNodes().get(slug), nowMs);
  const text =
    ageMs === null ? t("page.device.never_heard") : t("page.device.silent", { age: age(ageMs, t.language) });
  return (
    <Alert
      color="orange"
      variant="light"
      p="xs"
      icon={<IconClockOff aria-hidden />}
      title={of(name, text)}
      data-testid="silent"
    />
  );
}

/** After a restart everything is unknown: say so and offer the one thing that helps. What refused is not asked again. */
function Missing({ slug, reading, name }: { slug: string; reading: ReadAll; name: string | null }) {
  const t = useTexts();
  const { doc } = useDevice();
  const { store, recorded } = useShown();
  const slugs = useMemo(() => [slug], [slug]);
  const version = useCoarseVersion(slugs);
  const refused = reading.job?.failed;
  const missing = useMemo(
    () =>
      missingOf(
        doc.entries,
        (address) => store.cell(slug, address),
        new Set(refused?.map((failure) => failure.address)),
      ),
    // The store is read afresh whenever values of the device came.
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [doc, store, slug, version, refused],
  );
  if (version === 0 || missing.length === 0) return null;
  const all = doc.entries.filter((entry) => entry.readable).length;
  return (
    <div className={classes.reading} data-testid="missing">
      <span>
        {of(name, t(`page.read.${recorded ? "unseen" : "missing"}`, { missing: missing.length, all }))}
      </span>
      {!recorded && (
        <Button
          leftSection={<IconRefresh size={17} aria-hidden />}
          onClick={() => reading.start(missing.length === all ? null : missing)}
          data-testid="read-missing"
        >
          {t("page.read.now")}
        </Button>
      )}
    </div>
  );
}

type CellOf = (address: string) => Cell | undefined;

function missingOf(entries: readonly EntryDoc[], cellOf: CellOf, refused: ReadonlySet<string>): string[] {
  return entries
    .filter((entry) => entry.readable && cellOf(entry.address)?.known !== true)
    .map((entry) => entry.address)
    .filter((address) => !refused.has(address) && !isEmptyError(address, cellOf));
}

const ERROR_FIELD = /^1003:([0-9A-F]{2})$/i;

/** An error history that is shorter than its object has nothing to read (CiA 301, 7.5.2.4): its sub 0 counts it. */
function isEmptyError(address: string, cellOf: CellOf): boolean {
  const sub = ERROR_FIELD.exec(address)?.[1];
  const count = rawOf(cellOf("1003"));
  return sub !== undefined && typeof count === "number" && Number.parseInt(sub, 16) > count;
}

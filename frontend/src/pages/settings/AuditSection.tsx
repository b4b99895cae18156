import { Alert, Button, Loader, Select, TextInput } from "@mantine/core";
import {
  IconAlertOctagon,
  IconCircleCheck,
  IconDownload,
  IconFilter,
  IconShieldCheck,
} from "@tabler/icons-react";
import { useInfiniteQuery, useMutation, useQuery } from "@tanstack/react-query";
import { useVirtualizer } from "@tanstack/react-virtual";
import { useEffect, useRef, useState } from "react";
import { queryClient } from "../../api/queries";
import {
  type AuditFilter,
  auditHeadQuery,
  type AuditLine,
  auditPage,
  type AuditVerified,
  settings,
} from "../../api/settings";
import { usePageSearch } from "../../frame/search";
import { useEvents } from "../../live/live";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { notify } from "../../ui/notices";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { storyOf } from "../../ui/problem";
import { csvOf, download } from "../../ui/export";
import { dateTime } from "./dateTime";
import classes from "./Settings.module.css";

const PAGE_ROWS = 200;
const ROW_PX = 36;
/** So many rows before the end the next page is asked for. */
const AHEAD = 40;
const EXPORT_ROWS = 500;
const TYPING_MS = 250;

/** Who did what, when: every row bears the hash of the one before. */
export function AuditSection() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const filter: AuditFilter = {
    q: search.q ?? "",
    person: search.person ?? "",
    kind: search.kind ?? "",
    device: search.device ?? "",
  };
  return (
    <>
      <Head />
      <Filters filter={filter} onChange={update} />
      <Rows key={JSON.stringify(filter)} filter={filter} />
      <p className={classes.places}>{t("page.settings.audit.note")}</p>
    </>
  );
}

function Head() {
  const t = useTexts();
  const head = useQuery(auditHeadQuery);
  const verify = useMutation({
    mutationFn: settings.verifyAudit,
    onSettled: () => void queryClient.invalidateQueries({ queryKey: auditHeadQuery.queryKey }),
  });
  // Whatever happens may have made a row: the newest event tells when to look.
  const latest = useEvents()[0]?.id;
  useEffect(() => {
    void queryClient.invalidateQueries({ queryKey: ["audit"] });
  }, [latest]);
  if (head.isError) return <ProblemAlert error={head.error} title={t("page.settings.audit.failed")} />;
  if (!head.data) return <Loader aria-label={t("page.loading")} />;
  const { seq, hash, verified_t_ns: verified, failing } = head.data;
  return (
    <div className={classes.card}>
      <div className={classes.row}>
        <div style={{ minWidth: 0, flex: "1 1 320px" }}>
          <div className="dim" style={{ fontSize: 12.5 }}>
            {t("page.settings.audit.head", { rows: seq })}
          </div>
          <code className={`${classes.mono} ${classes.hash}`} title={hash} data-testid="audit-head">
            {hash || "–"}
          </code>
          <div className="dim" style={{ fontSize: 12.5 }}>
            {verified === null
              ? t("page.settings.audit.never_verified")
              : t("page.settings.audit.verified", { time: dateTime(verified / 1e6, t.language) })}
          </div>
        </div>
        <Button
          leftSection={<IconShieldCheck size={18} aria-hidden />}
          loading={verify.isPending}
          onClick={() => verify.mutate()}
          data-testid="verify"
        >
          {t("page.settings.audit.verify")}
        </Button>
      </div>
      {failing && (
        <Alert mt="sm" color="red" variant="light" icon={<IconAlertOctagon aria-hidden />}>
          {t("page.settings.audit.failing")}
        </Alert>
      )}
      {verify.error !== null && <ProblemAlert error={verify.error} title={t("page.settings.audit.failed")} />}
      {verify.data && <Verdict done={verify.data} />}
    </div>
  );
}

function Verdict({ done }: { done: AuditVerified }) {
  const t = useTexts();
  const Icon = done.good ? IconCircleCheck : IconAlertOctagon;
  const breach = done.breach_key === null ? "" : t(done.breach_key);
  return (
    <Alert
      mt="sm"
      color={done.good ? "green" : "red"}
      variant="light"
      icon={<Icon aria-hidden />}
      role="status"
      data-testid="audit-verdict"
      data-good={done.good}
    >
      {done.good
        ? t("page.settings.audit.good", { rows: done.rows })
        : t("page.settings.audit.broken", { row: done.broken_seq ?? 0, breach })}
    </Alert>
  );
}

interface FilterProps {
  filter: AuditFilter;
  onChange: (change: { q?: string; person?: string; kind?: string; device?: string }) => void;
}

const KINDS = [
  "written",
  "write_failed",
  "saved",
  "restart",
  "stop_sent",
  "feather_sent",
  "settings_changed",
  "connected",
  "disconnected",
  "consent",
  "visit_started",
  "visit_ended",
  "login",
  "login_failed",
  "logout",
  "launched",
  "user_added",
  "user_role",
  "user_password",
  "user_disabled",
  "user_enabled",
] as const;

function Filters({ filter, onChange }: FilterProps) {
  const t = useTexts();
  const [q, setQ] = useTyped(filter.q, (text) => onChange({ q: text }));
  const [person, setPerson] = useTyped(filter.person, (text) => onChange({ person: text }));
  const [device, setDevice] = useTyped(filter.device, (text) => onChange({ device: text }));
  const [exporting, setExporting] = useState(false);
  const save = async () => {
    setExporting(true);
    try {
      const rows = await allRows(filter);
      download(
        "hubside-audit.csv",
        csvOf([COLUMNS, ...rows.map((row) => exported(row, (line) => t(line.text_key, line.details)))]),
      );
    } catch (error) {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.settings.audit.export_failed"), lines: [story.happened] });
    } finally {
      setExporting(false);
    }
  };
  return (
    <div className={classes.row}>
      <TextInput
        style={{ flex: "1 1 150px" }}
        aria-label={t("page.settings.audit.text")}
        placeholder={t("page.settings.audit.text")}
        leftSection={<IconFilter size={17} aria-hidden />}
        value={q}
        onChange={(event) => setQ(event.currentTarget.value)}
        data-testid="audit-text"
      />
      <TextInput
        w={130}
        aria-label={t("page.settings.audit.person")}
        placeholder={t("page.settings.audit.person")}
        value={person}
        onChange={(event) => setPerson(event.currentTarget.value)}
      />
      <TextInput
        w={170}
        aria-label={t("page.settings.audit.device")}
        placeholder={t("page.settings.audit.device")}
        value={device}
        onChange={(event) => setDevice(event.currentTarget.value)}
      />
      <Select
        w={180}
        aria-label={t("page.settings.audit.kind")}
        placeholder={t("page.settings.audit.kind")}
        clearable
        data={KINDS.map((kind) => ({ value: kind, label: t(`page.settings.audit.kinds.${kind}`) }))}
        value={filter.kind || null}
        onChange={(kind) => onChange({ kind: kind ?? "" })}
      />
      <Button
        variant="default"
        leftSection={<IconDownload size={18} aria-hidden />}
        loading={exporting}
        onClick={() => void save()}
        data-testid="audit-export"
      >
        {t("page.settings.audit.export")}
      </Button>
    </div>
  );
}

/** A text that is typed, handed on when the typing rests. */
function useTyped(given: string, onRest: (text: string) => void): [string, (text: string) => void] {
  const [text, setText] = useState(given);
  const rest = useRef(onRest);
  useEffect(() => {
    rest.current = onRest;
  });
  useEffect(() => {
    if (text === given) return;
    const timer = setTimeout(() => rest.current(text), TYPING_MS);
    return () => clearTimeout(timer);
  }, [text, given]);
  return [text, setText];
}

const COLUMNS = ["seq", "time", "person", "device", "address", "kind", "text", "hash"];

function exported(row: AuditLine, text: (row: AuditLine) => string): string[] {
  const time = new Date(row.t_ns / 1e6).toISOString();
  const { seq, person, device, address, kind, hash } = row;
  return [String(seq), time, person, device ?? "", address ?? "", kind, text(row), hash];
}

async function allRows(filter: AuditFilter): Promise<AuditLine[]> {
  const rows: AuditLine[] = [];
  let before: number | null = null;
  do {
    const page = await auditPage(filter, before, EXPORT_ROWS);
    rows.push(...page.rows);
    before = page.before;
  } while (before !== null);
  return rows;
}

function Rows({ filter }: { filter: AuditFilter }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const scroll = useRef<HTMLDivElement>(null);
  const pages = useInfiniteQuery({
    queryKey: ["audit", "rows", filter],
    queryFn: ({ pageParam, signal }) => auditPage(filter, pageParam, PAGE_ROWS, signal),
    initialPageParam: null as number | null,
    getNextPageParam: (last) => last.before ?? undefined,
    staleTime: 0,
  });
  const rows = pages.data?.pages.flatMap((page) => page.rows) ?? [];
  const virtual = useVirtualizer({
    count: rows.length,
    getScrollElement: () => scroll.current,
    estimateSize: () => ROW_PX,
    overscan: 10,
  });
  const shown = virtual.getVirtualItems();
  const last = shown.at(-1)?.index ?? 0;
  const { hasNextPage, isFetchingNextPage, fetchNextPage } = pages;
  useEffect(() => {
    if (last >= rows.length - AHEAD && hasNextPage && !isFetchingNextPage) void fetchNextPage();
  }, [last, rows.length, hasNextPage, isFetchingNextPage, fetchNextPage]);
  if (pages.isError) return <ProblemAlert error={pages.error} title={t("page.settings.audit.failed")} />;
  return (
    <div
      className={classes.audit}
      role="table"
      aria-label={t("page.settings.section.audit")}
      aria-rowcount={-1}
    >
      <div className={classes.auditHead} role="row">
        {["row", "time", "person", "device", "text"].map((head) => (
          <span key={head} role="columnheader">
            {t(`page.settings.audit.columns.${head}`)}
          </span>
        ))}
      </div>
      <div className={classes.auditScroll} ref={scroll} tabIndex={0} role="rowgroup" data-testid="audit-rows">
        <div style={{ height: virtual.getTotalSize(), position: "relative" }} role="presentation">
          {shown.map((item) => {
            const row = rows[item.index];
            if (!row) return null;
            const text = t(row.text_key, row.details);
            const device = row.device === null ? "–" : nameOf(row.device);
            return (
              <div
                key={row.id}
                role="row"
                aria-rowindex={item.index + 1}
                className={classes.auditRow}
                style={{ transform: `translateY(${item.start}px)` }}
              >
                <span role="cell">{row.seq}</span>
                <span role="cell">{dateTime(row.t_ns / 1e6, t.language)}</span>
                <span role="cell" title={row.person}>
                  {row.person}
                </span>
                <span role="cell" title={row.device ?? ""}>
                  {device}
                </span>
                <span role="cell" title={`${text}\n${row.hash}`}>
                  {text}
                </span>
              </div>
            );
          })}
        </div>
        {pages.isSuccess && rows.length === 0 && (
          <p style={{ padding: 16 }} className="dim">
            {t("page.settings.audit.none")}
          </p>
        )}
      </div>
    </div>
  );
}

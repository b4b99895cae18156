import { Button, Checkbox, NumberInput, Select } from "@mantine/core";
import { IconCut, IconDownload, IconEyeOff } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import {
  exchange,
  exportDownload,
  type Format,
  FORMATS,
  lossesQuery,
  tableDownload,
} from "../../api/exchange";
import { replayedQuery } from "../../api/overlay";
import { digitsOf } from "../../api/trace";
import type { RecordingRef } from "../../api/types";
import { NeedsRole } from "../../frame/NeedsRole";
import { replayOfFile } from "../../replay/leaving";
import { useTexts } from "../../texts/texts";
import { timeOfDay } from "../../ui/format";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { Joining } from "./RecordingFilesJoin";
import { Made } from "./RecordingFilesMade";
import classes from "./RecordingFiles.module.css";

const PLACES = 3;
const TABLE = "parquet";
const EXPORTS = [...FORMATS.filter((one) => one !== "mcap"), TABLE] as const;

/** A recording for other tools and other people: exported, cut, anonymised. */
export function RecordingFiles({ file }: { file: RecordingRef }) {
  if (file.state === "live" || file.state === "unreadable") return null;
  return (
    <>
      <Exporting name={file.name} />
      <Making file={file} />
    </>
  );
}

function Exporting({ name }: { name: string }) {
  const t = useTexts();
  const [chosen, setChosen] = useState<(typeof EXPORTS)[number] | null>(null);
  const [exact, setExact] = useState(false);
  return (
    <div>
      <h3>{t("page.files.export")}</h3>
      <Select
        aria-label={t("page.files.export")}
        placeholder={t("page.files.format")}
        value={chosen}
        onChange={(value) => setChosen(EXPORTS.find((one) => one === value) ?? null)}
        data={EXPORTS.map((value) => ({ value, label: t(`page.files.format_of.${value}`) }))}
        data-testid="export-format"
      />
      {chosen !== null && (
        <div className={classes.block}>
          {chosen === TABLE ? (
            <span className="dim">{t("page.files.table_means")}</span>
          ) : (
            <>
              {chosen !== "pcapng" && (
                <Checkbox
                  label={t("page.files.exact")}
                  checked={exact}
                  onChange={(event) => setExact(event.currentTarget.checked)}
                  data-testid="export-exact"
                />
              )}
              <Losses name={name} format={chosen} exact={exact} />
            </>
          )}
          <Button
            variant="default"
            component="a"
            href={
              chosen === TABLE
                ? tableDownload(name)
                : exportDownload(name, { format: chosen, exact, startNs: null, endNs: null })
            }
            download
            leftSection={<IconDownload size={17} aria-hidden />}
            data-testid="export"
          >
            {t("page.files.export_now")}
          </Button>
        </div>
      )}
    </div>
  );
}

/** What would be lost, before anything is made. */
function Losses({ name, format, exact }: { name: string; format: Format; exact: boolean }) {
  const t = useTexts();
  const losses = useQuery(lossesQuery(name, { format, exact, startNs: null, endNs: null }));
  if (losses.isPending) return <span className="dim">{t("page.files.counting")}</span>;
  if (losses.isError) return <ProblemAlert error={losses.error} title={t("page.files.losses_failed")} />;
  if (losses.data.length === 0) return <span data-testid="losses">{t("page.files.no_losses")}</span>;
  return (
    <ul className={classes.losses} data-testid="losses">
      {losses.data.map((loss) => (
        <li key={loss.what}>{t(loss.text_key, loss.details)}</li>
      ))}
    </ul>
  );
}

/** Other recordings made of this one: a part, one with others, and a copy that does not tell whose it is. */
function Making({ file }: { file: RecordingRef }) {
  const t = useTexts();
  const [hidesTimes, setHidesTimes] = useState(false);
  const [made, setMade] = useState<string | null>(null);
  const onSuccess = ({ id }: { id: string }) => setMade(id);
  const anonymising = useMutation({ mutationFn: () => exchange.anonymise(file.name, hidesTimes), onSuccess });
  return (
    <div>
      <h3>{t("page.files.make")}</h3>
      <div className={classes.block}>
        <Cutting file={file} onStarted={setMade} />
        <Joining file={file} onStarted={setMade} />
        <Checkbox
          label={t("page.files.hide_times")}
          checked={hidesTimes}
          onChange={(event) => setHidesTimes(event.currentTarget.checked)}
        />
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              variant="default"
              disabled={locked}
              loading={anonymising.isPending}
              leftSection={<IconEyeOff size={17} aria-hidden />}
              title={locked ? undefined : t("page.files.anonymise_means")}
              onClick={() => anonymising.mutate()}
              data-testid="anonymise"
            >
              {t("page.files.anonymise")}
            </Button>
          )}
        </NeedsRole>
        {anonymising.isError && <ProblemAlert error={anonymising.error} title={t("page.files.failed")} />}
        {made !== null && <Made id={made} />}
      </div>
    </div>
  );
}

/** Cuts out a stretch; that of the loop where somebody replays it. */
function Cutting({ file, onStarted }: { file: RecordingRef; onStarted: (id: string) => void }) {
  const t = useTexts();
  const loop = useQuery(replayedQuery(replayOfFile(file.name))).data?.cursor.loop ?? null;
  const [typed, setTyped] = useState<{ fromS?: number | null; toS?: number | null }>({});
  const cutting = useMutation({
    mutationFn: ({ fromNs, toNs }: { fromNs: number; toNs: number }) =>
      exchange.cut(file.name, Number(digitsOf(fromNs)), Number(digitsOf(toNs))),
    onSuccess: ({ id }) => onStarted(id),
  });
  const [firstNs, lastNs] = [file.summary?.first_ns ?? null, file.summary?.last_ns ?? null];
  if (firstNs === null || lastNs === null) return null;
  const seconds = (tNs: number) => Number(((tNs - firstNs) / 1e9).toFixed(PLACES));
  const fromS = typed.fromS === undefined ? seconds(loop?.from_ns ?? firstNs) : typed.fromS;
  const toS = typed.toS === undefined ? seconds(loop?.to_ns ?? lastNs) : typed.toS;
  const fits = fromS !== null && toS !== null && fromS >= 0 && fromS < toS;
  const at = (value: number) => firstNs + Math.round(value * 1e9);
  const field = (name: "fromS" | "toS", value: number | null) => (
    <NumberInput
      label={t(`page.files.${name === "fromS" ? "from" : "to"}`)}
      value={value ?? ""}
      onChange={(next) =>
        setTyped((before) => ({ ...before, [name]: typeof next === "number" ? next : null }))
      }
      decimalScale={PLACES}
      decimalSeparator={t.language === "de" ? "," : "."}
      hideControls
      w={110}
      data-testid={`cut-${name}`}
    />
  );
  return (
    <>
      <div className={classes.cut}>
        {field("fromS", fromS)}
        {field("toS", toS)}
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              variant="default"
              disabled={locked || !fits}
              loading={cutting.isPending}
              leftSection={<IconCut size={17} aria-hidden />}
              onClick={() => fits && cutting.mutate({ fromNs: at(fromS), toNs: at(toS) })}
              data-testid="cut"
            >
              {t("page.files.cut")}
            </Button>
          )}
        </NeedsRole>
      </div>
      {fits && (
        <span className="dim">
          {t("page.mark.stretch", { from: timeOfDay(at(fromS) / 1e6), to: timeOfDay(at(toS) / 1e6) })}
        </span>
      )}
      {cutting.isError && <ProblemAlert error={cutting.error} title={t("page.files.failed")} />}
    </>
  );
}

import { CloseButton } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { attachmentDownload, recordingQuery } from "../../api/files";
import type { RecordingDoc, RecordingRef } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { figure } from "../../model/values";
import { useOpenReplay } from "../../replay/leaving";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import room from "../../ui/Room.module.css";
import { bytes, dayAndTime } from "../../ui/format";
import { Download, RecordingState, ReplayButton } from "./RecordingsPage";
import { RecordingFiles } from "./RecordingFiles";
import { RecoverSets } from "./RecoverSets";

/** What one recording holds, where it lies, and what is missing in it. */
export function RecordingDetails({ file }: { file: RecordingRef }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const replay = useOpenReplay();
  const doc = useQuery(recordingQuery(file.name));
  return (
    <section className={room.details} aria-label={file.name} data-testid="recording-details">
      <div className={room.detailsHead}>
        <h2>{file.name}</h2>
        <RecordingState state={file.state} />
        <span className={room.spacer} />
        <ReplayButton file={file} onReplay={replay} />
        <Download file={file} />
        <CloseButton aria-label={t("page.close")} onClick={() => update({ file: undefined })} />
      </div>
      <StateNote file={file} />
      <div className={room.detailsBody}>
        {doc.isError && <ProblemAlert error={doc.error} title={t("page.recordings.unreadable")} />}
        {doc.isPending && <span className="dim">{t("page.loading")}</span>}
        {doc.data && <Content doc={doc.data} file={file} />}
      </div>
    </section>
  );
}

/** What the state means for whoever wants to use the file, and what to do next. */
function StateNote({ file }: { file: RecordingRef }) {
  const t = useTexts();
  if (file.state === "finished" || file.state === "unread") return null;
  return (
    <p className={room.note}>
      {t(`page.recordings.note.${file.state}`, { reason: file.reason })}{" "}
      {file.state === "unfinished" && <code>hubside recover</code>}
    </p>
  );
}

function Content({ doc, file }: { doc: RecordingDoc; file: RecordingRef }) {
  const t = useTexts();
  const tables = Object.entries(doc.metadata).filter(([name]) => name !== "chunk_channels");
  return (
    <div className={room.columns}>
      <div>
        <h3>{t("page.recordings.where")}</h3>
        <p className={room.path} style={{ margin: 0, fontSize: 13 }}>
          {doc.path}
        </p>
      </div>
      {Object.keys(doc.topics).length > 0 && (
        <div>
          <h3>{t("page.recordings.topics")}</h3>
          <Pairs pairs={Object.entries(doc.topics).map(([name, n]) => [name, figure(n, 0, t.language)])} />
        </div>
      )}
      <Missing doc={doc} />
      <RecoverSets name={doc.name} />
      <RecordingFiles file={file} />
      {doc.attachments.length > 0 && (
        <div>
          <h3>{t("page.recordings.attachments")}</h3>
          <ul className={room.list}>
            {doc.attachments.map((one) => (
              <li key={one.name}>
                <a href={attachmentDownload(doc.name, one.name)} download className={room.link}>
                  <IconDownload size={15} aria-hidden /> {one.name}
                </a>
                <span className="dim">{bytes(one.size_bytes, t.language)}</span>
              </li>
            ))}
          </ul>
        </div>
      )}
      {tables.map(([name, table]) => (
        <div key={name}>
          <h3>{t.has(`page.recordings.table.${name}`) ? t(`page.recordings.table.${name}`) : name}</h3>
          <Pairs pairs={Object.entries(table).map(([key, text]) => [key, readable(key, text)])} />
        </div>
      ))}
    </div>
  );
}

/** Times are stored as nanoseconds, which nobody reads. */
function readable(key: string, text: string): string {
  return key.endsWith("_ns") && /^\d{18,20}$/.test(text) ? dayAndTime(Number(text) / 1e6) : text;
}

function Missing({ doc }: { doc: RecordingDoc }) {
  const t = useTexts();
  if (doc.state === "live") return null;
  const whole = doc.losses.length === 0 && doc.damages.length === 0;
  return (
    <div>
      <h3>{t("page.recordings.missing")}</h3>
      {whole && <p style={{ margin: 0, fontSize: 13 }}>{t("page.recordings.nothing_missing")}</p>}
      <ul className={room.list}>
        {doc.losses.map((loss) => (
          <li key={`${loss.t_ns} ${loss.text_key}`}>
            <span>{t(loss.text_key, loss.details)}</span>
            <span className="dim">{dayAndTime(loss.t_ns / 1e6)}</span>
          </li>
        ))}
        {doc.damages.map((damage) => (
          <li key={damage.offset}>
            <span className="tone-error">
              {t("page.recordings.damage", {
                size: bytes(damage.length, t.language),
                reason_key: `recording.damage.${damage.reason}`,
              })}
            </span>
            <span className="dim">{damage.offset}</span>
          </li>
        ))}
      </ul>
    </div>
  );
}

export function Pairs({ pairs }: { pairs: readonly (readonly [string, string])[] }) {
  return (
    <dl className={room.pairs}>
      {pairs.map(([name, text]) => (
        <div key={name} style={{ display: "contents" }}>
          <dt>{name}</dt>
          <dd>{text}</dd>
        </div>
      ))}
    </dl>
  );
}

import { Button, CloseButton, Menu } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { knownDescriptionQuery, setDownload, type SetFormat, setQuery } from "../../../api/sets";
import type { SetDoc, SetRecord } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { entriesOf } from "../../../ui/reading";
import { titleOf } from "../../../model/rows";
import { Pairs } from "../../recordings/RecordingDetails";
import { Completeness, nameOf } from "./columns";
import classes from "./Library.module.css";
import { Nameplate } from "./Nameplate";
import { SelectionTools } from "./SelectionTools";
import { TagChips } from "./TagChips";
import { ValueTable } from "./ValueTable";

/** One set: whose it is, its tags, what was not read, its values in words, and what can be done with it. */
export function SetDetails({ record }: { record: SetRecord }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const doc = useQuery(setQuery(record.id));
  return (
    <section className={room.details} aria-label={nameOf(record)} data-testid="set-details">
      <div className={room.detailsHead}>
        <h2>{nameOf(record)}</h2>
        {record.unread > 0 && <Completeness record={record} />}
        <TagChips tags={record.tags} />
        <span className={room.spacer} />
        <SelectionTools records={[record]} />
        <Export record={record} />
        <CloseButton aria-label={t("page.close")} onClick={() => update({ file: undefined })} />
      </div>
      <div className={room.detailsBody}>
        {doc.isError && <ProblemAlert error={doc.error} title={t("page.sets.unreadable")} />}
        {doc.isLoading && <span className="dim">{t("page.loading")}</span>}
        {doc.data && <Content doc={doc.data} />}
      </div>
    </section>
  );
}

const FORMATS: readonly SetFormat[] = ["json", "dcf", "csv"];

/** A DCF is of CANopen: for a device of another bus there is none. */
function Export({ record }: { record: SetRecord }) {
  const t = useTexts();
  const bus = useQuery(knownDescriptionQuery(record.description_id)).data?.bus;
  return (
    <Menu position="bottom-end" withinPortal>
      <Menu.Target>
        <Button
          variant="default"
          px={12}
          leftSection={<IconDownload size={17} aria-hidden />}
          data-testid="export-set"
        >
          {t("page.sets.export")}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {FORMATS.filter((one) => one !== "dcf" || bus === "canopen").map((one) => (
          <Menu.Item
            key={one}
            component="a"
            href={setDownload(record.id, one)}
            download
            data-testid={`export-${one}`}
          >
            {t(`page.sets.format.${one}`)}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

function Content({ doc }: { doc: SetDoc }) {
  const t = useTexts();
  const description = useQuery(knownDescriptionQuery(doc.record.description_id)).data;
  return (
    <>
      <details className={classes.facts} data-testid="set-facts">
        <summary>{t("page.sets.facts")}</summary>
        <div className={room.columns}>
          <Head doc={doc} />
          <Identity record={doc.record} />
          <Nameplate device={doc.record.origin.device} />
        </div>
      </details>
      <Unread
        doc={doc}
        nameOf={(address) => {
          const entry = description && entriesOf(description).get(address);
          return entry ? titleOf(entry, t) : "";
        }}
      />
      <ValueTable doc={doc} description={description} />
    </>
  );
}

function Head({ doc }: { doc: SetDoc }) {
  const t = useTexts();
  const { origin, description_id, description_version, hash, source } = doc.record;
  return (
    <div>
      <h3>{t("page.sets.origin")}</h3>
      <Pairs
        pairs={[
          [t("page.sets.column.device"), `${origin.device} (${origin.node})`],
          [t("page.sets.column.made"), origin.time],
          [t("page.sets.column.person"), origin.person || "–"],
          [t("page.sets.column.reason"), origin.reason || "–"],
          [t("page.sets.column.order"), origin.work_order || "–"],
          [t("page.sets.column.source"), t(`page.sets.source.${source}`)],
          [t("page.sets.column.description"), `${description_id} ${description_version}`],
          [t("page.sets.tool"), origin.tool],
          ["SHA-256", hash],
        ]}
      />
    </div>
  );
}

function Identity({ record }: { record: SetRecord }) {
  const t = useTexts();
  return (
    <div>
      <h3>{t("page.sets.identity")}</h3>
      <Pairs
        pairs={Object.entries(record.identity)
          .filter(([name, text]) => name !== "drive_serial" || text !== null)
          .map(([name, text]) => [t(`page.sets.identity_of.${name}`), text === null ? "–" : String(text)])}
      />
    </div>
  );
}

/** Every object that was not read, by name, with the reason. */
function Unread({ doc, nameOf: nameAt }: { doc: SetDoc; nameOf: (address: string) => string }) {
  const t = useTexts();
  const unread = Object.entries(doc.unread);
  if (unread.length === 0)
    return <p className={classes.plain}>{t("page.sets.unread_none", { empty: doc.empty.length })}</p>;
  return (
    <details className={classes.facts} data-testid="set-unread">
      <summary className="tone-warning">{t("page.sets.unread", { count: unread.length })}</summary>
      <Pairs pairs={unread.map(([address, why]) => [`${address} ${nameAt(address)}`, why] as const)} />
    </details>
  );
}

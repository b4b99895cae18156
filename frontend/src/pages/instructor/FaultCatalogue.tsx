import { Button, CloseButton, Loader, TextInput } from "@mantine/core";
import { IconFilter } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { type KeyboardEvent, useRef } from "react";
import { type FaultKind, faultKindsQuery } from "../../api/instructor";
import { usePageSearch } from "../../frame/search";
import { type Translate, useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { useTyped } from "../../ui/useTyped";
import { FaultForm } from "./FaultForm";
import classes from "./Instructor.module.css";

const LEVELS = ["device", "wire"] as const;

/** All kinds of fault by what they act on, and the form of the one that is chosen. */
export function FaultCatalogue({ answering }: { answering: boolean }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const kinds = useQuery(faultKindsQuery);
  if (kinds.isError && !kinds.data) {
    return (
      <div className={classes.problem}>
        <ProblemAlert error={kinds.error} title={t("page.instructor.catalogue_failed")} />
        <Button mt="sm" onClick={() => void kinds.refetch()}>
          {t("page.instructor.again")}
        </Button>
      </div>
    );
  }
  if (!kinds.data) return <Loader m="md" aria-label={t("page.loading")} />;
  const chosen = kinds.data.find((one) => one.id === search.kind) ?? kinds.data[0];
  return (
    <div className={classes.body}>
      <KindList
        kinds={kinds.data}
        chosen={chosen?.id}
        onChoose={(kind) => update({ kind, set: undefined, node: undefined })}
      />
      {chosen && <FaultForm key={chosen.id} kind={chosen} answering={answering} />}
    </div>
  );
}

interface ListProps {
  kinds: readonly FaultKind[];
  chosen: string | undefined;
  onChoose: (kind: string) => void;
}

function KindList({ kinds, chosen, onChoose }: ListProps) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const [find, setFind] = useTyped(search.find ?? "", (text) => update({ find: text }));
  const list = useRef<HTMLElement>(null);
  const shown = kinds.filter((kind) => fits(kind, find, t));
  const items = () => [...(list.current?.querySelectorAll<HTMLElement>("button[data-kind]") ?? [])];
  const onFilterKey = (event: KeyboardEvent) => {
    if (event.key !== "ArrowDown" && event.key !== "Enter") return;
    event.preventDefault();
    items()[0]?.focus();
  };
  const onListKey = (event: KeyboardEvent) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const all = items();
    const at = all.findIndex((one) => one === document.activeElement);
    if (step === undefined || at < 0) return;
    event.preventDefault();
    all[Math.min(all.length - 1, Math.max(0, at + step))]?.focus();
  };
  return (
    <div className={classes.choice}>
      <TextInput
        aria-label={t("page.instructor.filter")}
        placeholder={t("page.instructor.filter")}
        leftSection={<IconFilter size={17} aria-hidden />}
        rightSectionWidth={40}
        rightSection={
          find !== "" && <CloseButton aria-label={t("page.table.clear_filter")} onClick={() => setFind("")} />
        }
        value={find}
        onChange={(event) => setFind(event.currentTarget.value)}
        onKeyDown={onFilterKey}
        data-testid="find-fault"
      />
      <nav ref={list} className={classes.kinds} aria-label={t("page.instructor.kinds")} onKeyDown={onListKey}>
        {LEVELS.map((level) => {
          const some = shown.filter((kind) => kind.level === level);
          return (
            some.length > 0 && (
              <div key={level}>
                <h3>{t(`page.instructor.level.${level}`)}</h3>
                {some.map(({ id }) => (
                  <button
                    key={id}
                    type="button"
                    data-kind={id}
                    aria-current={id === chosen}
                    onClick={() => onChoose(id)}
                    data-testid={`kind-${id}`}
                  >
                    {t(`fault.${id}.name`)}
                  </button>
                ))}
              </div>
            )
          );
        })}
        {shown.length === 0 && <p className="dim">{t("page.instructor.none_match")}</p>}
      </nav>
    </div>
  );
}

function fits({ id }: FaultKind, find: string, t: Translate): boolean {
  const text = `${t(`fault.${id}.name`)} ${t(`fault.${id}.hint`)} ${id}`.toLowerCase();
  return find
    .toLowerCase()
    .split(/\s+/)
    .every((word) => text.includes(word));
}

import { Alert, Button, Group, Loader, Radio, Stack, Text } from "@mantine/core";
import { IconAlertTriangle, IconCircleCheck } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { commands } from "../../api/client";
import type { DescriptionDoc, EntryDoc } from "../../api/types";
import { useDeviceVersion, useStore } from "../../live/live";
import { figure } from "../../model/values";
import { titleOf } from "../../model/rows";
import { categoriesOf, categoryName } from "../../model/saving";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { HoldButton } from "../../ui/HoldButton";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { isStoredUnknown, isUnsaved } from "./cellValue";
import { useDevice } from "./context";
import { Dialog } from "../../ui/Dialog";
import classes from "./Parameters.module.css";

interface Props {
  doc: DescriptionDoc;
  onClose: () => void;
}

const MOST_NAMES = 6;

/** All of it is saved, or one category where the device has some. */
export function SaveDialog({ doc, onClose }: Props) {
  const categories = categoriesOf(doc);
  const [category, setCategory] = useState<string | null>(null);
  const entries = category === null ? doc.entries : doc.entries.filter((one) => isKeptBy(one, category));
  return (
    <CommandDialog
      name="save"
      tone="accent"
      run={(slug) => commands.save(slug, category)}
      onClose={onClose}
      manner={categories.length > 0 ? "still" : "command"}
      warning={
        <>
          {categories.length > 0 && (
            <CategoryChoice
              categories={categories}
              entries={doc.entries}
              value={category}
              onChange={setCategory}
            />
          )}
          <UnsavedList entries={entries} name="save" />
        </>
      }
    />
  );
}

export function RestartDialog({ doc, onClose }: Props) {
  return (
    <CommandDialog
      name="restart"
      tone="danger"
      run={commands.restart}
      onClose={onClose}
      manner={doc.bus === "profibus-dp" ? "hand" : doc.bus === "canopen" ? "command" : "still"}
      warning={<UnsavedList entries={doc.entries} name="restart" />}
    />
  );
}

interface CommandProps {
  name: "save" | "restart";
  tone: "accent" | "danger";
  run: (slug: string) => Promise<{ took_s: number; proven?: boolean | null }>;
  /** Still: at standstill only, and by itself, with no NMT and no safety chain. Hand: a person switches it off and on. */
  manner: "command" | "still" | "hand";
  warning: ReactNode;
  onClose: () => void;
}

/** Says what will happen to which device, and acts only on a held button. */
function CommandDialog({ name, tone, run, manner, warning, onClose }: CommandProps) {
  const t = useTexts();
  const { slug } = useDevice();
  const device = useDeviceName()(slug);
  const command = useMutation({ mutationFn: () => run(slug) });
  const key = (part: string) => `page.${name}.${part}`;
  return (
    <Dialog opened onClose={onClose} title={<Text fw={700}>{t(key("title"), { device })}</Text>} size="lg">
      <Stack gap="md">
        <Text>{t(key(manner === "command" ? "explain" : `explain_${manner}`), { device })}</Text>
        {command.isIdle && warning}
        {command.isPending && (
          <Group role="status">
            <Loader size="sm" aria-hidden />
            {t(key(manner === "hand" ? "running_hand" : "running"), { device })}
          </Group>
        )}
        {command.isSuccess && (
          <Alert
            color="green"
            role="status"
            icon={<IconCircleCheck aria-hidden />}
            data-testid={`${name}-done`}
          >
            {t(key("done"), { device, seconds: figure(command.data.took_s, 1, t.language) })}
          </Alert>
        )}
        {command.data?.proven != null && <Proof proven={command.data.proven} />}
        {command.isError && <ProblemAlert error={command.error} title={t(key("failed"), { device })} />}
        <Group justify="flex-end">
          <Button variant="default" onClick={onClose} data-autofocus data-testid={`${name}-close`}>
            {t(command.isSuccess ? "page.close" : "page.cancel")}
          </Button>
          {!command.isSuccess && (
            <HoldButton
              tone={tone}
              hint={t("page.hold")}
              disabled={command.isPending}
              onHeld={() => command.mutate()}
              testId={`${name}-hold`}
            >
              {t(key("hold"), { device })}
            </HoldButton>
          )}
        </Group>
      </Stack>
    </Dialog>
  );
}

/** Whether what was saved before the restart is in force: by the date and time that the device keeps with it. */
function Proof({ proven }: { proven: boolean }) {
  const t = useTexts();
  return (
    <Alert
      color={proven ? "green" : "red"}
      variant="light"
      icon={proven ? <IconCircleCheck aria-hidden /> : <IconAlertTriangle aria-hidden />}
      data-testid="restart-proof"
    >
      {t(`page.saving.${proven ? "proven" : "not_proven"}`)}
    </Alert>
  );
}

/** True where a save of the category keeps the value; what has none goes with each. */
const isKeptBy = (entry: EntryDoc, category: string): boolean =>
  entry.save_category === null || entry.save_category === category;

interface ChoiceProps {
  categories: readonly string[];
  entries: readonly EntryDoc[];
  value: string | null;
  onChange: (category: string | null) => void;
}

const EVERYTHING = "";

/** What is saved: all, or one category; behind each, how many values of it are known to be unsaved. */
function CategoryChoice({ categories, entries, value, onChange }: ChoiceProps) {
  const t = useTexts();
  const { slug } = useDevice();
  const store = useStore();
  useDeviceVersion(slug);
  const unsaved = entries.filter((entry) => isUnsaved(entry, store.cell(slug, entry.address)));
  return (
    <Radio.Group
      label={t("page.saving.what")}
      value={value ?? EVERYTHING}
      onChange={(text) => onChange(text === EVERYTHING ? null : text)}
      data-testid="save-category"
    >
      <div className={classes.categories}>
        {[null, ...categories].map((one) => {
          const count = unsaved.filter((entry) => one === null || entry.save_category === one).length;
          return (
            <Radio
              key={one ?? EVERYTHING}
              value={one ?? EVERYTHING}
              label={
                <span className={classes.category}>
                  {categoryName(one, t)}
                  <small className={count === 0 ? "dim" : ""}>{t("page.saving.count", { count })}</small>
                </span>
              }
              data-testid={`save-category-${one ?? "all"}`}
            />
          );
        })}
      </div>
    </Radio.Group>
  );
}

/** Which values stand in RAM only: a save keeps them, a restart loses them. */
function UnsavedList({ entries, name }: { entries: readonly EntryDoc[]; name: "save" | "restart" }) {
  const t = useTexts();
  const { slug } = useDevice();
  const store = useStore();
  useDeviceVersion(slug);
  const unsaved = entries.filter((entry) => isUnsaved(entry, store.cell(slug, entry.address)));
  const unknown = entries.some((entry) => isStoredUnknown(entry, store.cell(slug, entry.address)));
  if (unsaved.length === 0) {
    return (
      <Text className="dim">{t(unknown ? `page.${name}.stored_unknown` : `page.${name}.no_unsaved`)}</Text>
    );
  }
  const warning = name === "restart";
  return (
    <Alert
      color={warning ? "orange" : "blue"}
      variant="light"
      icon={warning ? <IconAlertTriangle aria-hidden /> : null}
      title={t(`page.${name}.unsaved`, { count: unsaved.length })}
    >
      <ul style={{ margin: 0, paddingLeft: 18 }}>
        {unsaved.slice(0, MOST_NAMES).map((entry) => (
          <li key={entry.address}>
            {entry.address} {titleOf(entry, t)}
          </li>
        ))}
        {unsaved.length > MOST_NAMES && <li>{t("page.more", { count: unsaved.length - MOST_NAMES })}</li>}
      </ul>
    </Alert>
  );
}

import { Button, Combobox, useCombobox } from "@mantine/core";
import { IconCheck, IconFileUpload, IconPlus } from "@tabler/icons-react";
import { useRef, useState } from "react";
import { MOST_COLUMNS } from "../../../api/compare";
import { useTexts } from "../../../texts/texts";
import { foundChoices, grouped } from "./choices";
import classes from "./Compare.module.css";
import { useChoices } from "./useChoices";
import { useUpload } from "./useUpload";

/** More than these are not drawn: a word narrows them. */
const MOST_SHOWN = 80;
const FILE = "file";

interface Props {
  columns: readonly string[];
  /** The kind of device that is compared; null while nothing is. */
  kind: string | null;
  onColumns: (columns: string[]) => void;
}

/** A list to type into: arrows move, Enter puts a column in or takes it out, Esc closes. */
export function ColumnPicker({ columns, kind, onColumns }: Props) {
  const t = useTexts();
  const [search, setSearch] = useState("");
  const file = useRef<HTMLInputElement>(null);
  const combobox = useCombobox({
    onDropdownClose: () => {
      combobox.resetSelectedOption();
      combobox.focusTarget();
      setSearch("");
    },
    onDropdownOpen: () => {
      combobox.focusSearchInput();
      combobox.selectFirstOption();
    },
  });
  const upload = useUpload(columns[0] ?? null, kind, (column) => onColumns([...columns, column]));
  const choices = useChoices(kind, columns[0] ?? null);
  const found = foundChoices(choices, search);
  const full = columns.length >= MOST_COLUMNS;
  const submit = (value: string) => {
    if (value === FILE) {
      combobox.closeDropdown();
      file.current?.click();
    } else if (columns.includes(value)) onColumns(columns.filter((one) => one !== value));
    else if (!full) onColumns([...columns, value]);
  };
  return (
    <>
      <Combobox store={combobox} width={400} position="bottom-start" onOptionSubmit={submit}>
        <Combobox.Target targetType="button">
          <Button
            px="sm"
            variant={columns.length === 0 ? "filled" : "default"}
            leftSection={<IconPlus size={17} aria-hidden />}
            onClick={() => combobox.toggleDropdown()}
            data-testid="add-column"
          >
            {t("page.compare.add")}
          </Button>
        </Combobox.Target>
        <Combobox.Dropdown>
          <Combobox.Search
            role="combobox"
            aria-expanded
            value={search}
            onChange={(event) => {
              setSearch(event.currentTarget.value);
              combobox.resetSelectedOption();
            }}
            placeholder={t("page.compare.picker.search")}
            aria-label={t("page.compare.picker.search")}
            data-testid="column-search"
          />
          <Combobox.Options className={classes.options} aria-label={t("page.compare.picker.list")}>
            <Combobox.Option value={FILE} data-testid="column-file">
              <span className={classes.option}>
                <IconFileUpload size={17} aria-hidden />
                <span>
                  {t("page.compare.picker.file")}
                  <small>{t("page.compare.picker.file_hint")}</small>
                </span>
              </span>
            </Combobox.Option>
            {grouped(found.slice(0, MOST_SHOWN)).map(([group, members]) => (
              <Combobox.Group key={group} label={group}>
                {members.map((one) => {
                  const chosen = columns.includes(one.column);
                  return (
                    <Combobox.Option
                      key={one.column}
                      value={one.column}
                      active={chosen}
                      disabled={!chosen && (full || one.absent)}
                      data-testid={`choice-${one.column}`}
                    >
                      <span className={classes.option}>
                        <span>
                          {one.label}
                          <small>{one.hint}</small>
                        </span>
                        {chosen && <IconCheck size={17} aria-label={t("page.compare.picker.chosen")} />}
                      </span>
                    </Combobox.Option>
                  );
                })}
              </Combobox.Group>
            ))}
            {found.length === 0 && <Combobox.Empty>{t("page.compare.picker.none")}</Combobox.Empty>}
            {found.length > MOST_SHOWN && (
              <Combobox.Empty>
                {t("page.compare.picker.more", { count: found.length - MOST_SHOWN })}
              </Combobox.Empty>
            )}
          </Combobox.Options>
        </Combobox.Dropdown>
      </Combobox>
      <input
        ref={file}
        type="file"
        accept=".json,.dcf,.csv"
        hidden
        aria-label={t("page.compare.picker.file")}
        onChange={(event) => {
          const [chosen] = event.currentTarget.files ?? [];
          event.currentTarget.value = "";
          if (chosen) void upload(chosen);
        }}
        data-testid="column-upload"
      />
    </>
  );
}

import { Tabs } from "@mantine/core";
import { type ComponentType, Suspense } from "react";
import { type PageSearch, usePageSearch } from "../frame/search";
import classes from "./Tabs.module.css";

interface Props {
  /** Begins the names by which tests find the tabs. */
  name: string;
  label: string;
  titleOf: (tab: string) => string;
  /** By name; the first one needs no mention in the address. */
  tabs: Readonly<Record<string, ComponentType>>;
  /** The one that is shown where the address names none. */
  usual?: string | undefined;
  /** Parts of the address that belong to one tab and would mean something else, or nothing, in another. */
  own: readonly (keyof PageSearch)[];
}

/** A room in tabs; each comes when it is looked at. */
export function TabbedRoom({ name, label, titleOf, tabs, usual, own }: Props) {
  const [search, update] = usePageSearch();
  const names = Object.keys(tabs);
  const shown = names.find((one) => one === search.tab) ?? usual ?? names[0];
  const Tab = shown === undefined ? null : tabs[shown];
  const open = (tab: string | null) => {
    const left = Object.fromEntries(own.map((part) => [part, undefined]));
    update({ ...left, tab: tab === null || tab === names[0] ? undefined : tab });
  };
  return (
    <div className={classes.page}>
      <Tabs value={shown ?? null} onChange={open} aria-label={label}>
        <Tabs.List>
          {names.map((one) => (
            <Tabs.Tab key={one} value={one} h={40} data-testid={`${name}-tab-${one}`}>
              {titleOf(one)}
            </Tabs.Tab>
          ))}
        </Tabs.List>
      </Tabs>
      <div className={classes.tab}>
        <Suspense>{Tab && <Tab />}</Suspense>
      </div>
    </div>
  );
}

import { ActionIcon, Button, Menu, TextInput } from "@mantine/core";
import { IconCheck, IconLayoutRows, IconTrash } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { type DeskView, putViews, viewsQuery } from "../../../api/desk";
import { queryClient } from "../../../api/queries";
import { useTexts } from "../../../texts/texts";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";
import classes from "./Desk.module.css";
import type { Plots } from "./usePlots";

const NOTHING: readonly DeskView[] = [];

/** The usual view and those that the person has kept under names. */
export function Views({ plots }: { plots: Plots }) {
  const t = useTexts();
  const views = useQuery(viewsQuery).data ?? NOTHING;
  const [name, setName] = useState("");
  const keeping = useMutation({
    mutationFn: putViews,
    onSuccess: (kept) => queryClient.setQueryData(viewsQuery.queryKey, kept),
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("desk.views_failed"), lines: [story.happened] });
    },
  });
  const current = views.find((one) => one.plots === plots.text);
  const own = plots.text === plots.usual ? t("desk.view_usual") : t("desk.view_own");
  const keep = () => {
    const kept = name.trim();
    if (kept === "" || plots.text === "") return;
    keeping.mutate([...views.filter((one) => one.name !== kept), { name: kept, plots: plots.text }]);
    setName("");
  };
  return (
    <Menu position="bottom-start" shadow="md" closeOnItemClick>
      <Menu.Target>
        <Button
          variant="default"
          px="sm"
          leftSection={<IconLayoutRows size={17} aria-hidden />}
          data-testid="views"
        >
          <span className={classes.viewName}>{current?.name ?? own}</span>
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item
          leftSection={<IconCheck size={16} opacity={plots.text === plots.usual ? 1 : 0} />}
          onClick={() => plots.show(plots.usual)}
          data-testid="view-usual"
        >
          {t("desk.view_usual")}
        </Menu.Item>
        {views.map((view) => (
          <div key={view.name} className={classes.view}>
            <Menu.Item
              leftSection={<IconCheck size={16} opacity={view === current ? 1 : 0} />}
              onClick={() => plots.show(view.plots)}
              data-testid={`view-${view.name}`}
            >
              {view.name}
            </Menu.Item>
            <ActionIcon
              variant="subtle"
              aria-label={t("desk.view_remove", { name: view.name })}
              onClick={() => keeping.mutate(views.filter((one) => one !== view))}
            >
              <IconTrash size={16} aria-hidden />
            </ActionIcon>
          </div>
        ))}
        <Menu.Divider />
        <form
          className={classes.keepView}
          onSubmit={(event) => {
            event.preventDefault();
            keep();
          }}
        >
          <TextInput
            aria-label={t("desk.view_name")}
            placeholder={t("desk.view_name")}
            value={name}
            onChange={(event) => setName(event.currentTarget.value)}
            // Letters are the name, not a way through the menu.
            onKeyDown={(event) => event.stopPropagation()}
            data-testid="view-name"
          />
          <Button type="submit" variant="default" disabled={name.trim() === ""} data-testid="view-keep">
            {t("desk.view_keep")}
          </Button>
        </form>
      </Menu.Dropdown>
    </Menu>
  );
}

import { Button, Menu, Tooltip } from "@mantine/core";
import { IconKey, IconLogout, IconUser, IconUsers } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { sessionQuery } from "../api/queries";
import { startAfresh, signing } from "../api/settings";
import { useTexts } from "../texts/texts";
import { notify } from "../ui/notices";
import { storyOf } from "../ui/problem";
import classes from "./Frame.module.css";
import { useOpenSettings } from "./search";

/** Who is signed in, in which role; the way out. */
export function UserMenu() {
  const t = useTexts();
  const openSettings = useOpenSettings();
  const session = useQuery(sessionQuery).data;
  const logout = useMutation({
    mutationFn: signing.out,
    onSuccess: startAfresh,
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.user.logout_failed"), lines: [story.happened, story.next] });
    },
  });
  if (!session) return null;
  const role = t(`page.role.${session.role}`);
  const launch = session.user === null;
  return (
    <Menu position="bottom-end" width={260}>
      <Menu.Target>
        <Tooltip label={t("page.user.is", { name: session.person, role })}>
          <Button
            className={classes.userButton ?? ""}
            variant="default"
            px={10}
            leftSection={<IconUser size={18} aria-hidden />}
            aria-label={t("page.user.is", { name: session.person, role })}
            data-testid="user"
          >
            <span className={classes.userName}>{session.person}</span>
          </Button>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>
          {session.person} · {role}
        </Menu.Label>
        {launch && <Menu.Label style={{ fontWeight: 400 }}>{t("page.user.launch")}</Menu.Label>}
        <Menu.Item
          mih={40}
          onClick={() => openSettings("users")}
          leftSection={launch ? <IconUsers size={18} aria-hidden /> : <IconKey size={18} aria-hidden />}
        >
          {t(launch ? "page.user.manage" : "page.user.password")}
        </Menu.Item>
        <Menu.Item
          mih={40}
          leftSection={<IconLogout size={18} aria-hidden />}
          onClick={() => logout.mutate()}
          disabled={launch}
          data-testid="logout"
        >
          {t("page.user.logout")}
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}

import { Menu, UnstyledButton } from "@mantine/core";
import {
  IconCheck,
  IconChevronDown,
  IconDoorExit,
  IconPlug,
  IconPlugOff,
  IconSettings,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { lazy, Suspense, useState } from "react";
import { turbineQuery } from "../api/queries";
import { knownTurbinesQuery } from "../api/settings";
import { useTexts } from "../texts/texts";
import { storyOf } from "../ui/problem";
import { type Connecting, useConnecting } from "./connecting";
import classes from "./Frame.module.css";
import { useRole } from "./role";
import { useOpenSettings } from "./search";

const EndVisit = lazy(async () => ({ default: (await import("./ConnectVisit")).EndVisit }));

/** The turbine that is connected, and the way to another one, or to none. */
export function ConnectMenu() {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  const { connect, disconnect, busy } = useConnecting();
  const [ending, setEnding] = useState(false);
  const name = turbine?.name ?? t("page.connect.none");
  return (
    <>
      {ending && (
        <Suspense>
          <EndVisit onClose={() => setEnding(false)} />
        </Suspense>
      )}
      <Menu position="bottom-start" width={340} keepMounted={false}>
        <Menu.Target>
          <UnstyledButton
            className={classes.connect}
            aria-label={t("page.connect.open", { turbine: name })}
            data-testid="connect-menu"
          >
            <span className={classes.turbine} data-testid="turbine">
              {busy ? t("page.connect.busy") : name}
            </span>
            <IconChevronDown size={18} aria-hidden />
          </UnstyledButton>
        </Menu.Target>
        <Menu.Dropdown>
          <Choices
            connect={connect}
            disconnect={disconnect}
            connected={turbine !== undefined}
            busy={busy}
            onEnd={() => setEnding(true)}
          />
        </Menu.Dropdown>
      </Menu>
    </>
  );
}

interface ChoicesProps extends Connecting {
  connected: boolean;
  onEnd: () => void;
}

function Choices({ connect, disconnect, connected, busy, onEnd }: ChoicesProps) {
  const t = useTexts();
  const { why } = useRole();
  const known = useQuery(knownTurbinesQuery);
  const openSettings = useOpenSettings();
  const reason = why("technician");
  const locked = reason !== null || busy;
  return (
    <>
      <Menu.Label>{t("page.connect.choose")}</Menu.Label>
      {reason !== null && <Menu.Label style={{ fontWeight: 400 }}>{reason}</Menu.Label>}
      {known.isError && <Menu.Label>{storyOf(known.error, t).happened}</Menu.Label>}
      {(known.data ?? []).map((one) => (
        <Menu.Item
          key={one.slug}
          mih={48}
          disabled={locked || one.connected}
          leftSection={
            one.connected ? <IconCheck size={18} aria-hidden /> : <IconPlug size={18} aria-hidden />
          }
          onClick={() => connect(one.slug)}
          data-testid={`connect-${one.slug}`}
        >
          <div>
            {one.name}
            {one.connected && ` · ${t("page.connect.is")}`}
          </div>
          <div className="dim" style={{ fontSize: 12.5, overflowWrap: "anywhere" }}>
            {one.buses.join(", ")}
          </div>
        </Menu.Item>
      ))}
      <Menu.Divider />
      <Menu.Item
        mih={40}
        disabled={locked || !connected}
        leftSection={<IconDoorExit size={18} aria-hidden />}
        onClick={onEnd}
        data-testid="visit"
      >
        {t("page.visit.open")}
      </Menu.Item>
      <Menu.Item
        mih={40}
        disabled={locked || !connected}
        leftSection={<IconPlugOff size={18} aria-hidden />}
        onClick={disconnect}
        data-testid="disconnect"
      >
        {t("page.connect.disconnect")}
      </Menu.Item>
      <Menu.Item
        mih={40}
        leftSection={<IconSettings size={18} aria-hidden />}
        onClick={() => openSettings("turbines")}
      >
        {t("page.connect.manage")}
      </Menu.Item>
    </>
  );
}

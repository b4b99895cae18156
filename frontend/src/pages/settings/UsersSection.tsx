import { Alert, Badge, Button, Loader, PasswordInput, Select, TextInput } from "@mantine/core";
import { IconInfoCircle, IconKey, IconUserOff, IconUserPlus, IconUserCheck } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { type SyntheticEvent, useState } from "react";
import { queryClient, sessionQuery } from "../../api/queries";
import { settings, startAfresh, type User, type UserChange, usersQuery } from "../../api/settings";
import { ROLES, type Role, useRole } from "../../frame/role";
import { useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { OwnPassword } from "./OwnPassword";
import classes from "./Settings.module.css";

/** Characters of a password at least, as the server has it. */
export const SHORTEST = 10;

/** Who may do what. While there are no users, the printed address lets one person in, as a technician. */
export function UsersSection() {
  const t = useTexts();
  const session = useQuery(sessionQuery).data;
  const { may, why } = useRole();
  if (!session) return null;
  if (!session.login_needed) return <FirstUser />;
  return (
    <>
      {may("expert") ? (
        <Users />
      ) : (
        <Alert color="blue" variant="light" icon={<IconInfoCircle aria-hidden />} data-testid="users-locked">
          {t("page.settings.users.experts_only")} {why("expert")}
        </Alert>
      )}
      <OwnPassword />
      <Roles />
    </>
  );
}

function Roles() {
  const t = useTexts();
  return (
    <div className={classes.card}>
      <h2>{t("page.settings.users.roles")}</h2>
      <dl className={classes.facts} style={{ gridTemplateColumns: "minmax(100px, auto) 1fr" }}>
        {ROLES.map((role) => (
          <RoleLine key={role} role={role} />
        ))}
      </dl>
    </div>
  );
}

function RoleLine({ role }: { role: Role }) {
  const t = useTexts();
  return (
    <>
      <dt style={{ fontSize: 14 }}>{t(`page.role.${role}`)}</dt>
      <dd style={{ fontWeight: 400 }}>{t(`page.settings.users.role.${role}`)}</dd>
    </>
  );
}

/** What the first user changes is said before, because it cannot be taken back from the page. */
function FirstUser() {
  const t = useTexts();
  const [made, setMade] = useState(false);
  return (
    <>
      <Alert color="yellow" variant="light" icon={<IconInfoCircle aria-hidden />} data-testid="first-user">
        {t("page.settings.users.first")}
      </Alert>
      {made ? (
        <Alert color="green" variant="light">
          {t("page.settings.users.first_made")}{" "}
          <Button ml="sm" onClick={startAfresh}>
            {t("page.boot.login_button")}
          </Button>
        </Alert>
      ) : (
        <NewUser first onMade={() => setMade(true)} />
      )}
      <Roles />
    </>
  );
}

function Users() {
  const t = useTexts();
  const users = useQuery(usersQuery);
  const [adding, setAdding] = useState(false);
  if (users.isError) return <ProblemAlert error={users.error} title={t("page.settings.users.failed")} />;
  if (!users.data) return <Loader aria-label={t("page.loading")} />;
  return (
    <>
      <div className={classes.tableBox}>
        <table className={classes.table} data-testid="users">
          <thead>
            <tr>
              {["name", "role", "state", "action"].map((head) => (
                <th key={head} data-head={head}>
                  {t(`page.settings.users.head.${head}`)}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {users.data.map((user) => (
              <UserRow key={user.id} user={user} />
            ))}
          </tbody>
        </table>
      </div>
      {adding ? (
        <NewUser onMade={() => setAdding(false)} onClose={() => setAdding(false)} />
      ) : (
        <div>
          <Button
            leftSection={<IconUserPlus size={18} aria-hidden />}
            onClick={() => setAdding(true)}
            data-testid="add-user"
          >
            {t("page.settings.users.add")}
          </Button>
        </div>
      )}
    </>
  );
}

function UserRow({ user }: { user: User }) {
  const t = useTexts();
  const [asking, setAsking] = useState(false);
  const change = useMutation({
    mutationFn: (wanted: UserChange) => settings.changeUser(user.id, wanted),
    onSuccess: async () => {
      setAsking(false);
      notify({ tone: "ok", title: t("page.settings.users.changed", { name: user.name }), lines: [] });
      await queryClient.invalidateQueries({ queryKey: usersQuery.queryKey });
      await queryClient.invalidateQueries({ queryKey: sessionQuery.queryKey });
    },
  });
  return (
    <>
      <tr data-testid={`user-${user.name}`}>
        <td>
          <strong>{user.name}</strong>{" "}
          {user.you && <span className="dim">({t("page.settings.users.you")})</span>}
        </td>
        <td>
          <Select
            w={150}
            aria-label={t("page.settings.users.role_of", { name: user.name })}
            data={ROLES.map((role) => ({ value: role, label: t(`page.role.${role}`) }))}
            value={user.role}
            allowDeselect={false}
            disabled={change.isPending}
            onChange={(role) => change.mutate({ role: role ?? user.role })}
          />
        </td>
        <td>
          <Badge color={user.disabled ? "gray.7" : "var(--hs-live)"} variant="filled" tt="none">
            {t(user.disabled ? "page.settings.users.disabled" : "page.settings.users.active")}
          </Badge>
        </td>
        <td>
          <div className={classes.actions}>
            <Button
              variant="default"
              leftSection={<IconKey size={18} aria-hidden />}
              aria-expanded={asking}
              onClick={() => setAsking(!asking)}
            >
              {t("page.settings.users.password")}
            </Button>
            <Button
              variant="default"
              leftSection={
                user.disabled ? (
                  <IconUserCheck size={18} aria-hidden />
                ) : (
                  <IconUserOff size={18} aria-hidden />
                )
              }
              disabled={change.isPending || user.you}
              title={user.you ? t("page.settings.users.not_yourself") : undefined}
              onClick={() => change.mutate({ disabled: !user.disabled })}
            >
              {t(user.disabled ? "page.settings.users.enable" : "page.settings.users.disable")}
            </Button>
          </div>
        </td>
      </tr>
      {(asking || change.error !== null) && (
        <tr data-open>
          <td colSpan={4}>
            {asking && <PasswordForm name={user.name} onSet={(password) => change.mutate({ password })} />}
            {change.error !== null && (
              <ProblemAlert error={change.error} title={t("page.settings.users.not_changed")} />
            )}
          </td>
        </tr>
      )}
    </>
  );
}

function PasswordForm({ name, onSet }: { name: string; onSet: (password: string) => void }) {
  const t = useTexts();
  const [password, setPassword] = useState("");
  const submit = (event: SyntheticEvent) => {
    event.preventDefault();
    if (password.length >= SHORTEST) onSet(password);
  };
  return (
    <form className={classes.row} onSubmit={submit} style={{ alignItems: "flex-start" }}>
      <PasswordInput
        w={280}
        aria-label={t("page.settings.users.password_of", { name })}
        placeholder={t("page.settings.users.password_new")}
        description={t("page.settings.users.password_rule", { least: SHORTEST })}
        inputWrapperOrder={["label", "input", "description", "error"]}
        autoComplete="new-password"
        value={password}
        onChange={(event) => setPassword(event.currentTarget.value)}
      />
      <Button type="submit" disabled={password.length < SHORTEST}>
        {t("page.settings.users.password_set")}
      </Button>
      <span className="dim" style={{ paddingTop: 9 }}>
        {t("page.settings.users.password_note", { name })}
      </span>
    </form>
  );
}

interface NewProps {
  first?: boolean;
  onMade: () => void;
  onClose?: () => void;
}

function NewUser({ first = false, onMade, onClose }: NewProps) {
  const t = useTexts();
  const [name, setName] = useState("");
  const [password, setPassword] = useState("");
  const [role, setRole] = useState<Role>(first ? "expert" : "technician");
  const adding = useMutation({
    mutationFn: () => settings.addUser({ name: name.trim(), password, role }),
    onSuccess: async () => {
      onMade();
      if (!first) await queryClient.invalidateQueries({ queryKey: usersQuery.queryKey });
    },
  });
  const ready = name.trim() !== "" && password.length >= SHORTEST;
  const submit = (event: SyntheticEvent) => {
    event.preventDefault();
    if (ready && !adding.isPending) adding.mutate();
  };
  return (
    <form className={classes.card} onSubmit={submit} data-testid="new-user">
      <h2>{t(first ? "page.settings.users.first_title" : "page.settings.users.add")}</h2>
      <div className={classes.row} style={{ alignItems: "flex-start" }}>
        <TextInput
          w={220}
          label={t("page.settings.users.head.name")}
          autoComplete="off"
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
          data-testid="new-name"
        />
        <PasswordInput
          w={240}
          label={t("page.settings.users.password")}
          description={t("page.settings.users.password_rule", { least: SHORTEST })}
          inputWrapperOrder={["label", "input", "description", "error"]}
          autoComplete="new-password"
          value={password}
          onChange={(event) => setPassword(event.currentTarget.value)}
          data-testid="new-password"
        />
        <Select
          w={150}
          label={t("page.settings.users.head.role")}
          data={ROLES.map((one) => ({ value: one, label: t(`page.role.${one}`) }))}
          value={role}
          allowDeselect={false}
          disabled={first}
          description={first ? t("page.settings.users.first_role") : undefined}
          inputWrapperOrder={["label", "input", "description", "error"]}
          onChange={(chosen) => setRole(chosen ?? role)}
        />
      </div>
      {adding.error !== null && (
        <ProblemAlert error={adding.error} title={t("page.settings.users.not_added")} />
      )}
      <div className={classes.row} style={{ marginTop: 12 }}>
        <Button type="submit" disabled={!ready} loading={adding.isPending} data-testid="make-user">
          {t(first ? "page.settings.users.first_button" : "page.settings.users.add_button")}
        </Button>
        {onClose && (
          <Button variant="default" onClick={onClose}>
            {t("page.cancel")}
          </Button>
        )}
      </div>
    </form>
  );
}

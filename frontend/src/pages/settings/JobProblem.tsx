import { Problem } from "../../api/client";
import { ProblemAlert } from "../../ui/ProblemAlert";
import type { StartedJob } from "./useSettingsJob";

/** Why work on an adapter could not be begun, or failed. */
export function JobProblem({ work, title }: { work: StartedJob; title: string }) {
  const error = work.error ?? (work.job?.error ? asProblem(work.job.error) : null);
  return error === null ? null : <ProblemAlert error={error} title={title} />;
}

type Failure = NonNullable<NonNullable<StartedJob["job"]>["error"]>;

function asProblem({ code, text_key, details }: Failure): Problem {
  return new Problem({ type: "", title: code, status: 0, code, text_key, details, device_state: null });
}

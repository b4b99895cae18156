import { describe, expect, it } from "vitest";
import { axisStateKey, severityOf, shaftLook } from "./axisState";

describe("statusword", () => {
  it("tells the state whatever the other bits are", () => {
    expect(axisStateKey(0x0640)).toBe("axis_state.switch_on_disabled");
    expect(axisStateKey(0x1637)).toBe("axis_state.operation_enabled");
    expect(axisStateKey(0x0218)).toBe("axis_state.fault");
    expect(axisStateKey(0x0233)).toBe("axis_state.switched_on");
    expect(axisStateKey(0x0001)).toBeNull();
  });

  it("makes a warning of a code only where nothing says fault", () => {
    expect(severityOf(0x02b7)).toBe("warning");
    expect(severityOf(0x0288)).toBe("error");
    expect(severityOf(null)).toBe("error");
  });

  it("looks like the worst that is known", () => {
    expect(shaftLook(0x0237, 0)).toBe("enabled");
    expect(shaftLook(0x02b7, 0x8612)).toBe("warning");
    expect(shaftLook(0x0217, 0)).toBe("warning");
    expect(shaftLook(0x0237, 0x8611)).toBe("fault");
    expect(shaftLook(0x0218, null)).toBe("fault");
    expect(shaftLook(null, null)).toBe("idle");
  });
});

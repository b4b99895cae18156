"""A restore of one station as a transaction: pre-check, intents, writes, confirmation, save, restart, proof.

The states, as the store keeps them (``store.restore_rows.RestoreState``)::

    begin ──> WRITING ──> AWAITING_CONFIRMATION ──> SAVING ──> RESTARTING ──> PROVING ──> DONE ("new")
                 │                │                    │           │             │
                 └────────────────┴── a failure, no confirmation, a cancel ──────┘
                                                │
                                                v                 (resume: from WRITING on, without a confirmation,
                 INCOMPLETE <── fails ── ROLLING_BACK                for resuming is one)
                   │   ^                        │
         resume ───┤   └── the bus or the       └──> ROLLED_BACK ("old")
      roll back ───┘       store is gone, the tool ends, at any instant

What each crash point leaves, and why both ways out lead out of it:

* Before anything is written, all values of the plan are read and kept with the wanted ones. They are the only truth of
  a rollback: it never rests on what was, or may have been, written.
* Each step is committed as an intent before it is carried out; its outcome is committed with the next intent. After a
  crash the last step may have been done or not: resume and rollback read the devices anew and plan from what is there,
  so neither needs to know. Doing a step twice does no harm: writes are of values, saves and restarts repeat.
* Until a save is begun, non-volatile memory holds what it held. A rollback writes RAM alone then; a restart of the
  device, or a power cut, only helps it along.
* From the intent of a save on, non-volatile memory may hold old or new values, until another save is acknowledged. Both
  ways out save such devices again, after all values stand in RAM.
* The values are read once more before the first save: whatever hid a restart or another master's write (a gap in the
  frames, say) is seen there, not made permanent.
* A device that boots by itself in between lost what stood in RAM: its boot-up message is looked for before and after
  each step. The restore rolls back by itself then: planned anew from what the device holds after its start.
* An axis that is driven meanwhile (STOP and FEATHER always go through, and so does the safety chain) ends the writing
  at once; a rollback waits until it stands, and at last leaves the decision to a person.
* STOP or FEATHER, another master, or a recording that ends, halt it: INCOMPLETE, without a rollback that nobody asked
  for. The commands are counted (``Driver.commanded``): neither a write of the controlword nor a restart follows one
  that came after a person decided last.
* Whoever takes it up again finds the same devices and a fit station (``precheck``), else it stays INCOMPLETE.
* What can never be finished, for its device is gone, an expert closes: GIVEN_UP, audited, with a reason.
* A cable that was pulled, or a store that cannot be written, ends as INCOMPLETE without a rollback: a write that cannot
  be journalled is not made. A tool that was killed leaves a state that is not ended; the next one finds it and says
  INCOMPLETE. The deadline of a confirmation is measured on the monotonic clock of the tool that asked for it, so that
  it is over with that tool.
* As long as a restore is not ended the gate (``service.gate``) is shut: no write, save or restart of that station by
  anybody, and so no motion. STOP and FEATHER do not pass through the gate.

"New" is claimed only where every value of the plan was read equal at the end; "proven" only where that was after a
restart of every device that was saved.
"""

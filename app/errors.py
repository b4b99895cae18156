"""The one tree of errors. Every error has a code, a text key for the operator and named details.

::

    HubsideError
    ├── UsageError                 exit 2   the command or file does not make sense
    │   ├── DescriptionError                a description or EDS file: file, line, reason
    │   ├── SiteError                       a site file: file, key, reason
    │   ├── SetFileError                    a parameter-set file: file, line, reason
    │   ├── ColumnError                     a column of a comparison that cannot be shown; names it
    │   ├── ForeignFileError                a recording of others cannot be read: file, line, what was expected
    │   ├── SignatureError                  the text of a search is not understood; names the position
    │   ├── MotorFileError                  a file of motors: file, line, column, reason
    │   ├── BundleError                     a bundle of an incident cannot be opened: file, reason
    │   ├── SigningKeyError                 the key that seals records cannot be made or read
    │   ├── ExtraMissingError               an optional package is not installed; says how to get it
    │   └── StoreError                      the store cannot be opened, read or written
    │       ├── StoreDamagedError           its file is damaged
    │       ├── StoreInUseError             another process has the data folder
    │       └── StoreBusyError              it did not answer in time
    ├── RefusedError               exit 3   refused by us, nothing was sent
    │   ├── UnknownObjectError              the description has no such address
    │   ├── AccessError                     read-only, write-only or factory object
    │   ├── ValueTypeError                  the value does not fit the data type
    │   ├── LimitError                      the value is out of range; names the limit
    │   ├── PreconditionError               another object or state forbids it
    │   ├── OrderError                      no order of writes keeps all rules at every step
    │   ├── NotWrittenError                 a write before it in its batch left a value that is not known
    │   ├── ConflictError                   another value than the one that was seen stands in RAM
    │   ├── OvertakenError                  STOP or FEATHER came before the write left
    │   ├── MotionError                     the write could set an axis in motion
    │   ├── CommunicationError              the write changes PDOs, or is a save or load command
    │   ├── AddressChangeError              the write changes where the device is found, and nobody has confirmed that
    │   ├── ConsentError                    active access needs consent (other master seen)
    │   ├── SettingsError                   a setting cannot be changed so, or not now
    │   ├── NotConnectedError               no turbine is connected
    │   ├── RoleError                       the role of the person does not cover it
    │   ├── LoginError                      name or password is wrong
    │   ├── LoginPausedError                too many failed logins: wait
    │   ├── LoginNeededError                users exist, so one must log in
    │   ├── NoVisitError                    no visit is open
    │   ├── UserUnknownError                no such user
    │   ├── UserExistsError                 the name is taken
    │   ├── UserRuleError                   a name or password that is not taken
    │   ├── LastExpertError                 one expert must remain
    │   ├── MotorFieldError                 a field of a motor is missing or does not fit
    │   ├── MotorUnknownError               no such motor, or no such version of it
    │   ├── MotorChangedError               somebody else has changed the motor meanwhile
    │   ├── MotorInventedError              the motor is an invented example
    │   ├── IncidentFieldError              a field of an incident or annotation does not fit
    │   ├── IncidentUnknownError            no such incident, or no such version of it
    │   ├── IncidentChangedError            somebody else has changed the incident meanwhile
    │   ├── IncidentRecordingError          the recording of an incident is not there, or is another file
    │   ├── AnnotationUnknownError          no such annotation
    │   ├── DeviceBusyError                 something is under way at the device that must not be cut in two
    │   ├── RestoreOpenError                a restore of the station is not finished
    │   ├── RestoreRefusedError             the pre-check of a restore found reasons against it
    │   ├── RestoreChangedError             the plan of a restore is no longer the one that was looked at
    │   ├── RestoreStateError               not in the state that a restore is in
    │   ├── RestoreUnknownError             no such restore
    │   ├── RestoreRecordError              a restore of which there is no record
    │   ├── SetUnknownError                 no such parameter set
    │   ├── SetTagError                     a tag that visits give, not people
    │   ├── SetIncompleteError              a set with unread objects cannot be golden
    │   ├── NameplateError                  a serial number that is none, or typed differently twice
    │   ├── ReplayOnlyError                 a replay can never write to a device
    │   ├── RecordingLiveError              a recording that is being written cannot be replayed
    │   ├── ReplayEndedError                the replay was closed
    │   ├── MomentError                     a moment of a recording that cannot be had
    │   ├── IndexMissingError               the index of a recording is not made yet
    │   ├── LeaseNeededError                nobody has the lease of the axes
    │   ├── LeaseHeldError                  another page has the lease, or asks for it already
    │   ├── LeaseError                      an old lease: another one was given since
    │   ├── OldOrderError                   an order to an axis that came before, or late
    │   ├── NotHeldError                    nobody holds what moves the axis
    │   ├── InterlockError                  an interlock keeps the axis from moving; names it
    │   ├── AxisStateError                  the axis is in another state than the command wants
    │   ├── NotPreparedError                motion of the axis is not prepared
    │   ├── PdoRefusedError                 PDOs cannot be set up so; says which one and why
    │   ├── PdoUnknownError                 how a PDO is set up is not known: it was not read
    │   ├── PdoChangedError                 a PDO is set up otherwise than when it was looked at
    │   ├── PdoBusyError                    PDOs cannot be changed now; says why
    │   ├── PdoNoUndoError                  no change of PDOs that could be put back
    │   ├── BatteryConditionError           a condition of the battery test does not hold; names it
    │   ├── BatteryNotNotedError            the old battery was not noted before its change
    │   ├── SignalUnknownError              no such run of a test signal
    │   ├── ScopeSettingsError              a setting of the scope that does not fit; names the field
    │   ├── ScopeStateError                 not in the state that the scope is in
    │   ├── ScopeUnknownError               no such capture
    │   ├── ScopeCaptureError               a capture that cannot be kept or read
    │   ├── ScopeSpectrumError              values of which no spectrum can be made; says why
    │   ├── NoInstructorError               the connected turbine is none of the twins that we started
    │   └── FaultOrderError                 a fault that cannot be put into a twin so; names the field
    │       └── FaultValueError             one of its values is out of range; names the limits
    ├── DeviceError                exit 4   the device answered and refused
    │   ├── SdoAbortError                   CiA 301 abort code
    │   ├── ModbusExceptionError            Modbus exception code
    │   ├── PkwRefusedError                 error code of the PKW channel
    │   └── IdentityError                   another device than expected answered
    ├── NoAnswerError              exit 5   nothing came in time
    │   ├── BusLostError                    the adapter or its server is gone
    │   ├── BusOpenError                    the adapter could not be opened
    │   │   └── ForeignMasterError              another master is on a line that has room for one
    │   └── TwinsGoneError                  the twins that we started do not answer
    ├── UnverifiedError            exit 6   sent, but what was read back differs or could not be read
    │   ├── BatteryCommandError             a command to the battery management has no effect
    │   ├── BatteryArmedError               the link was lost while a battery test was armed
    │   ├── BatteryCounterError             the charge counter is not known to be 0
    │   └── BatteryUnsavedError             the charge counter is 0, but not saved
    ├── RestoreBrokenError         exit 6   a restore ended otherwise than ordered; says why
    ├── PdoRolledBackError         exit 6   a change of PDOs failed; what stood before stands again, read back
    ├── PdoBrokenError             exit 6   a change of PDOs failed, and could not be put back
    ├── RecordingError             exit 2   a recording is damaged or cannot be written
    └── ProtocolError              exit 4   bytes on the wire that no rule of the protocol allows

The exit codes are those of the command line.
"""

from __future__ import annotations

from typing import Any, ClassVar


class HubsideError(Exception):
    """Base of all errors that the tool raises on purpose.

    ``code`` is stable and machine-readable; ``text_key`` names the operator's text in ``app/locales``;
    ``details`` fills the placeholders of that text.
    """

    code: ClassVar[str] = "error"
    exit_code: ClassVar[int] = 1

    def __init__(self, **details: Any) -> None:
        self.details = details
        super().__init__(", ".join(f"{key}={value}" for key, value in details.items()))

    @property
    def text_key(self) -> str:
        """Key of the operator's text in the locale catalogue."""
        return f"error.{self.code}"


def because(error: HubsideError) -> dict[str, Any]:
    """``error`` as the reason of another one: what it tells, and the key of its text as ``reason_key``."""
    details = dict(error.details)
    return {**details, "reason_key": details.pop("text_key_reason", None) or error.text_key}


class UsageError(HubsideError):
    """The command or file does not make sense. Details: reason."""

    code = "usage"
    exit_code = 2


class DescriptionError(UsageError):
    """A description or EDS file is wrong. Details: file, line, reason."""

    code = "description"


class SignatureError(UsageError):
    """The text of a search is not understood. Details: position (of a character, from 1), found, reason_key."""

    code = "signature"


class SiteError(UsageError):
    """A site file is wrong. Details: file, key, reason."""

    code = "site"


class SetFileError(UsageError):
    """A parameter-set file is wrong. Details: file, line, reason."""

    code = "set_file"


class SigningKeyError(UsageError):
    """The key that seals records cannot be made or read. Details: file, reason."""

    code = "signing_key"


class ExtraMissingError(UsageError):
    """What is asked for needs a package that is not installed. Details: package, extra (of ours, which brings it)."""

    code = "extra_missing"


class ForeignFileError(UsageError):
    """A recording of others cannot be read. Details: file, line, found, why, expected_key (a text key)."""

    code = "foreign_file"


class MotorFileError(UsageError):
    """A file of motors is wrong; none was taken. Details: file, line, column, reason_key and what it is about."""

    code = "motor_file"


class BundleError(UsageError):
    """A bundle of an incident cannot be opened. Details: file, reason_key and what it is about."""

    code = "bundle"


class ColumnError(UsageError):
    """A column of a comparison cannot be shown. Details: column, reason_key."""

    code = "column"


class StoreError(UsageError):
    """The store cannot be opened, read or written. Details: file, reason."""

    code = "store"


class StoreDamagedError(StoreError):
    """The store's file is damaged. Details: file, reason."""

    code = "store_damaged"


class StoreInUseError(StoreError):
    """Another process has the data folder. Details: file."""

    code = "store_in_use"


class StoreBusyError(StoreError):
    """The store did not answer in time; what was asked may still be done. Details: file, timeout_s."""

    code = "store_busy"


class RefusedError(HubsideError):
    """Refused before anything was sent. Details: device, address, reason."""

    code = "refused"
    exit_code = 3


class UnknownObjectError(RefusedError):
    """The description has no such address. Details: device, address."""

    code = "unknown_object"


class AccessError(RefusedError):
    """The object's access forbids it. Details: address, name, access."""

    code = "access"


class ValueTypeError(RefusedError):
    """The value does not fit the data type. Details: address, name, type, value."""

    code = "value_type"


class LimitError(RefusedError):
    """The value is out of range. Details: address, name, value, minimum, maximum, unit."""

    code = "limit"


class PreconditionError(RefusedError):
    """Another object or the device's state forbids it. Details: address, name, needs, found."""

    code = "precondition"


class OrderError(RefusedError):
    """Written with the rest of its batch, at no turn would the rules hold that must hold after every write.

    Nothing was written. Details: address, name.
    """

    code = "order"


class NotWrittenError(RefusedError):
    """Its batch ended before it: of a write that had no clear end nobody knows what it left, and the order rests on it.

    Nothing was written. Details: address, name, after (the address of that write), after_device.
    """

    code = "not_written"


class ConflictError(RefusedError):
    """RAM no longer holds what the change was made from. Details: address, name, expected, found."""

    code = "conflict"


class OvertakenError(RefusedError):
    """STOP or FEATHER went to the object before the write left: it was not sent. Details: bus, node, address."""

    code = "overtaken"


class MotionError(RefusedError):
    """The write could set an axis in motion, and nobody has taken charge of that. Details: address, name."""

    code = "motion"


class CommunicationError(RefusedError):
    """The write changes PDOs or is a save or load command, and was not asked for as such. Details: address, name."""

    code = "communication"


class AddressChangeError(RefusedError):
    """The write changes at which address the device is found, and nobody has confirmed that.

    Details: address, name, connected (where it is reached now, a dash where that is not known).
    """

    code = "address_change"


class ConsentError(RefusedError):
    """Active access needs consent: another master is on the bus. Details: bus, seen."""

    code = "consent"


class SettingsError(RefusedError):
    """A setting cannot be changed so, or not now. Details: reason_key (a text key) and what it is about."""

    code = "settings"


class NotConnectedError(RefusedError):
    """No turbine is connected, so no device can be asked."""

    code = "not_connected"


class ReplayOnlyError(RefusedError):
    """What is shown is a recording: nothing in it can be written, saved, moved or restarted."""

    code = "replay_only"


class RecordingLiveError(RefusedError):
    """The recording is being written; what it holds so far can be looked at in the rooms. Details: recording."""

    code = "recording_live"


class ReplayEndedError(RefusedError):
    """The replay was closed; it can be opened again. Details: recording (its name)."""

    code = "replay_ended"


class MomentError(RefusedError):
    """A moment of a recording that cannot be had. Details: recording, reason."""

    code = "moment"


class IndexMissingError(RefusedError):
    """The index of the recording is not made yet. Details: recording (its file)."""

    code = "index_missing"


class RoleError(RefusedError):
    """The person's role does not cover it. Details: needs, has (names of roles)."""

    code = "role"


class LoginError(RefusedError):
    """Name or password is wrong; which of them is not told."""

    code = "login"


class LoginPausedError(RefusedError):
    """Too many failed logins under this name from this address. Details: retry_after_s."""

    code = "login_paused"


class LoginNeededError(RefusedError):
    """Users exist, so one must log in."""

    code = "login_needed"


class NoVisitError(RefusedError):
    """No visit is open: one begins with a connection."""

    code = "no_visit"


class UserUnknownError(RefusedError):
    """No such user. Details: name."""

    code = "user_unknown"


class UserExistsError(RefusedError):
    """The name is taken, by a disabled user perhaps. Details: name."""

    code = "user_exists"


class UserRuleError(RefusedError):
    """A name or password that is not taken. Details: reason."""

    code = "user_rule"


class LastExpertError(RefusedError):
    """One expert must remain who can log in. Details: name."""

    code = "last_expert"


class MotorFieldError(RefusedError):
    """A field of a motor is missing or does not fit. Details: field, reason_key and what it is about."""

    code = "motor_field"


class MotorUnknownError(RefusedError):
    """No such motor, or no such version of it. Details: motor."""

    code = "motor_unknown"


class MotorChangedError(RefusedError):
    """The motor has another version than the one that was changed. Details: motor, version, newest."""

    code = "motor_changed"


class MotorInventedError(RefusedError):
    """The motor is an invented example: never changed, deleted, or put into a real drive. Details: motor."""

    code = "motor_invented"


class IncidentFieldError(RefusedError):
    """A field of an incident or annotation does not fit. Details: field, reason_key and what it is about."""

    code = "incident_field"


class IncidentUnknownError(RefusedError):
    """No such incident, or no such version of it. Details: incident."""

    code = "incident_unknown"


class IncidentChangedError(RefusedError):
    """The incident has another version than the one that was changed. Details: incident, version, newest."""

    code = "incident_changed"


class IncidentRecordingError(RefusedError):
    """The recording of an incident is not there, or another file has its name. Details: recording, reason_key."""

    code = "incident_recording"


class AnnotationUnknownError(RefusedError):
    """No such annotation. Details: annotation."""

    code = "annotation_unknown"


class DeviceBusyError(RefusedError):
    """Something is under way at the device that must not be cut in two. Details: device, work_key, person."""

    code = "device_busy"


class RestoreOpenError(RefusedError):
    """A restore of the station is not finished: its values may be half old, half new. Details: station, restore."""

    code = "restore_open"


class RestoreRefusedError(RefusedError):
    """The pre-check found reasons against the restore; nothing was written. Details: station, reasons (texts)."""

    code = "restore_refused"


class RestoreChangedError(RefusedError):
    """The station, or what is wanted, is no longer what the plan was made from. Details: station."""

    code = "restore_changed"


class RestoreStateError(RefusedError):
    """The restore is in another state than this needs. Details: restore, state_key."""

    code = "restore_state"


class RestoreUnknownError(RefusedError):
    """No such restore. Details: restore."""

    code = "restore_unknown"


class RestoreRecordError(RefusedError):
    """Of this restore there is no record, and none can be made. Details: restore."""

    code = "restore_record"


class SetUnknownError(RefusedError):
    """No such parameter set in the library. Details: set."""

    code = "set_unknown"


class SetTagError(RefusedError):
    """Visits give this tag, not people. Details: tag."""

    code = "set_tag"


class SetIncompleteError(RefusedError):
    """A set with unread objects cannot be golden: what it lacks would not be compared. Details: set, tag, unread."""

    code = "set_incomplete"


class NameplateError(RefusedError):
    """The serial number of a nameplate is none, or the second entry differs. Details: device, reason_key."""

    code = "nameplate"


class LeaseNeededError(RefusedError):
    """Nobody has the lease of the axes."""

    code = "lease_needed"


class LeaseHeldError(RefusedError):
    """Another page has the lease, or asks for it already. Details: holder."""

    code = "lease_held"


class LeaseError(RefusedError):
    """The command bears the number of an old lease. Details: holder."""

    code = "lease"


class OldOrderError(RefusedError):
    """An order to an axis that came before, or later than one that was given after it. Details: order, latest."""

    code = "old_order"


class NotHeldError(RefusedError):
    """Nobody holds what moves the axis, or it was let go. Details: device."""

    code = "not_held"


class InterlockError(RefusedError):
    """An interlock keeps the axis from moving. Details: device, interlock, reason_key and what fills it."""

    code = "interlock"


class AxisStateError(RefusedError):
    """The axis is otherwise than the command needs it.

    Details: device, state or state_key, wanted, wanted_key or wanted_keys, and what fills them.
    """

    code = "axis_state"


class NotPreparedError(RefusedError):
    """Motion of the axis is not prepared. Details: device."""

    code = "not_prepared"


class PdoRefusedError(RefusedError):
    """PDOs cannot be set up so. Details: device, pdo, reason_key (a finding's text key) and what fills it."""

    code = "pdo_refused"


class PdoUnknownError(RefusedError):
    """How a PDO is set up is not known: its objects were not read, or hold no PDO. Details: device, pdo."""

    code = "pdo_unknown"


class PdoChangedError(RefusedError):
    """A PDO is set up otherwise than when it was looked at; nothing was written. Details: device, pdo."""

    code = "pdo_changed"


class PdoBusyError(RefusedError):
    """PDOs of a device cannot be changed now. Details: device, reason_key."""

    code = "pdo_busy"


class PdoNoUndoError(RefusedError):
    """There is no change of PDOs that could be put back. Details: device."""

    code = "pdo_no_undo"


class BatteryConditionError(RefusedError):
    """A condition of the battery test does not hold. Details: device, condition, reason_key and what fills it."""

    code = "battery_condition"


class BatteryNotNotedError(RefusedError):
    """The old battery was not noted before its change. Details: device."""

    code = "battery_not_noted"


class SignalUnknownError(RefusedError):
    """No such run of a test signal. Details: run."""

    code = "signal_unknown"


class ScopeSettingsError(RefusedError):
    """A setting of the scope does not fit. Details: field, reason_key (a text key with what it needs)."""

    code = "scope_settings"


class ScopeStateError(RefusedError):
    """The scope is in another state. Details: state_key (a text key)."""

    code = "scope_state"


class ScopeUnknownError(RefusedError):
    """There is no such capture. Details: capture."""

    code = "scope_unknown"


class ScopeCaptureError(RefusedError):
    """A capture cannot be kept, or read. Details: capture, reason."""

    code = "scope_capture"


class ScopeSpectrumError(RefusedError):
    """No spectrum can be made of these values. Details: reason_key (a text key), count, least."""

    code = "scope_spectrum"


class NoInstructorError(RefusedError):
    """Faults go only into twins that this server has started, and the connected turbine is none of them."""

    code = "no_instructor"


class FaultOrderError(RefusedError):
    """A fault that cannot be put into a twin so. Details: field, reason."""

    code = "fault_order"


class FaultValueError(FaultOrderError):
    """A value of the fault is out of range. Details: field, value, limits (as text), minimum, maximum, unit."""

    code = "fault_value"


class DeviceError(HubsideError):
    """The device answered and refused. Details: node, reason."""

    code = "device"
    exit_code = 4


class SdoAbortError(DeviceError):
    """The device aborted an SDO transfer (CiA 301, 7.2.4.3.17).

    Details: node, address, abort_code (int), text_key_reason.
    """

    code = "sdo_abort"

    @property
    def abort_code(self) -> int:
        """The 32-bit abort code."""
        return int(self.details["abort_code"])


class ModbusExceptionError(DeviceError):
    """The device refused a Modbus request with an exception code (V1.1b3, chapter 7).

    Details: node, address, function, exception (int), text_key_reason.
    """

    code = "modbus_exception"


class PkwRefusedError(DeviceError):
    """The device refused a job of the PKW channel (ED2 manual, 4.6).

    Details: node, address, name, pkw_code (int), text_key_reason.
    """

    code = "pkw_refused"


class IdentityError(DeviceError):
    """Another device than the expected one answered. Details: node, expected, found."""

    code = "identity"


class NoAnswerError(HubsideError):
    """Nothing came in time. Details: node, address, timeout_s."""

    code = "no_answer"
    exit_code = 5


class BusLostError(NoAnswerError):
    """The adapter or its server is gone. Details: bus, reason."""

    code = "bus_lost"


class BusOpenError(NoAnswerError):
    """The adapter could not be opened. Details: bus, reason."""

    code = "bus_open"


class ForeignMasterError(BusOpenError):
    """Somebody else talks on a line on which only one master may: nothing is sent. Details: bus, reason_key, master."""

    code = "foreign_master"


class TwinsGoneError(NoAnswerError):
    """The twins that we started do not answer. Details: reason."""

    code = "twins_gone"


class UnverifiedError(HubsideError):
    """Sent, but not verified. Details: address, name, sent, found, reason_key and what fills it."""

    code = "unverified"
    exit_code = 6


class BatteryCommandError(UnverifiedError):
    """A command to the battery management has no effect. Details: device, command, word (3040h now), seconds."""

    code = "battery_command"


class BatteryArmedError(UnverifiedError):
    """The link was lost while a battery test was armed: it may begin. Details: device, reason_key with its own."""

    code = "battery_armed"


class BatteryCounterError(UnverifiedError):
    """The charge counter is not known to be 0. Details: device, counter (as read, or a dash), reason_key."""

    code = "battery_counter"


class BatteryUnsavedError(UnverifiedError):
    """The charge counter is 0 in RAM and the save was not acknowledged. Details: device, reason_key."""

    code = "battery_unsaved"


class RestoreBrokenError(HubsideError):
    """A restore ended otherwise than ordered. Details: station, device, cause_key (a text key), end_key."""

    code = "restore_broken"
    exit_code = 6


class PdoRolledBackError(HubsideError):
    """A change of PDOs failed; what stood before stands again and was read back. Details: device, reason_key."""

    code = "pdo_rolled_back"
    exit_code = 6


class PdoBrokenError(HubsideError):
    """A change of PDOs failed, and what stood before could not be put back. Details: device, reason_key, again_key."""

    code = "pdo_broken"
    exit_code = 6


class RecordingError(HubsideError):
    """A recording is damaged or cannot be written. Details: file, offset, reason."""

    code = "recording"
    exit_code = 2


class ProtocolError(HubsideError):
    """Bytes on the wire that no rule of the protocol allows. Details: bus, reason."""

    code = "protocol"
    exit_code = 4

"""An OPC UA server of asyncua for tests: loops with PV, SP and OP, a history of its own, a list of all requests."""

from __future__ import annotations

import asyncio
import socket
import threading
from datetime import UTC, datetime, timedelta

from asyncua import Server, ua
from asyncua.common.utils import ServiceError
from asyncua.server.history import HistoryDict
from asyncua.server.uaprocessor import UaProcessor

NAMESPACE = "urn:plant"
ROLES = (("PV", "m3/h", 50.0), ("SP", "m3/h", 50.0), ("OP", "%", 100.0))
START = datetime(2026, 3, 2, 6, 0, tzinfo=UTC)


class KeptHistory(HistoryDict):
    """History that survives the server; it gives at most some values a call, with a continuation point or without."""

    def __init__(self, plant: OpcUaPlant) -> None:
        super().__init__(10**9)
        self.plant, self.kept = plant, plant.kept

    async def new_historized_node(self, node_id, period, count=0):
        self.kept.setdefault(node_id.to_string(), [])

    async def save_node_value(self, node_id, datavalue):
        self.kept[node_id.to_string()].append(datavalue)

    async def read_node_history(self, node_id, start, end, nb_values):
        stored = self.kept.get(node_id.to_string(), [])
        if end < start:
            backwards = [one for one in reversed(stored) if end <= one.SourceTimestamp <= start]
            return backwards[: nb_values or None], None
        found = [one for one in stored if start <= one.SourceTimestamp <= end]
        page = self.plant.page
        if self.plant.has_points and len(found) > page:
            # the next page begins at a time, so that values with this time are not split
            return found[:page], found[page].SourceTimestamp
        return found[: min(nb_values, page) or None], None


class OpcUaPlant:
    """A server in a thread of its own."""

    def __init__(self, loops: int = 2, page: int = 10**9, *, has_points: bool = False, port: int | None = None) -> None:
        self.kept: dict[str, list[ua.DataValue]] = {}
        self.requests: list[str] = []
        self.loops, self.page, self.has_points = loops, page, has_points
        self.refuse_history: str = ""
        """`nodes`: no node has a history; `service`: there is no service for it."""
        self.port = port or free_port()
        self.url = f"opc.tcp://127.0.0.1:{self.port}/plant"
        self.security: list[ua.SecurityPolicyType] = [ua.SecurityPolicyType.NoSecurity]
        self.certificate: tuple | None = None
        self.users: dict[str, str] | None = None
        self.nodes: dict[str, ua.NodeId] = {}

    def __enter__(self) -> OpcUaPlant:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, args=(ready,), daemon=True)
        self._thread.start()
        assert ready.wait(30)

    def clear(self) -> None:
        """Forget all values and requests, and page as most servers do."""
        for rows in self.kept.values():
            rows.clear()
        self.requests.clear()
        self.page, self.has_points = 10**9, False

    def stop(self) -> None:
        if self._loop.is_running():
            asyncio.run_coroutine_threadsafe(self._server.stop(), self._loop).result(30)
            self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(30)

    def write(self, tag: str, value: object, moment: datetime, status: int = 0) -> None:
        """Write a value into the server, and so into its history."""
        asyncio.run_coroutine_threadsafe(self.write_now(tag, value, moment, status), self._loop).result(30)

    async def write_now(self, tag: str, value: object, moment: datetime, status: int = 0) -> None:
        kind = ua.VariantType.String if isinstance(value, str) else ua.VariantType.Double
        data = ua.DataValue(ua.Variant(value, kind), ua.StatusCode(status), SourceTimestamp=moment)
        await self._server.get_node(self.nodes[tag]).write_value(data)

    def delete(self, tag: str) -> None:
        """Take a variable from the running server."""
        node = self._server.get_node(self.nodes[tag])
        asyncio.run_coroutine_threadsafe(self._server.delete_nodes([node]), self._loop).result(30)

    def add_again(self, tag: str) -> None:
        """Give a variable that was deleted back to the running server, under its old node id."""

        async def add() -> None:
            node = self.nodes[tag]
            await self._server.nodes.objects.add_variable(node, tag, 0.0, ua.VariantType.Double)

        asyncio.run_coroutine_threadsafe(add(), self._loop).result(30)

    def keep(self, tag: str, seconds, values, status=None) -> None:
        """Put values into the history without passing through the server."""
        rows = self.kept.setdefault(self.nodes[tag].to_string(), [])
        for k, (moment, value) in enumerate(zip(seconds, values, strict=True)):
            code = ua.StatusCode(0 if status is None else int(status[k]))
            stamp = START + timedelta(seconds=float(moment))
            rows.append(ua.DataValue(ua.Variant(value), code, SourceTimestamp=stamp))

    def _run(self, ready: threading.Event) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._build())
        ready.set()
        self._loop.run_forever()

    async def _build(self) -> None:
        manager = _Users(self.users) if self.users else None
        server = Server(user_manager=manager) if manager else Server()
        self._server = server
        await server.init()
        server.set_endpoint(self.url)
        server.set_security_policy(self.security)
        if self.certificate:
            await server.load_certificate(str(self.certificate[0]))
            await server.load_private_key(str(self.certificate[1]))
        server.iserver.history_manager.set_storage(KeptHistory(self))
        if self.refuse_history:
            server.iserver.history_manager._read_history = self._refuse_history
        index = await server.register_namespace(NAMESPACE)
        area = await server.nodes.objects.add_folder(index, "Unit 1")
        for k in range(self.loops):
            loop = await area.add_object(index, f"FIC-{101 + k}")
            for number, (role, unit, high) in enumerate(ROLES):
                node = ua.NodeId(1000 + 10 * k + number, index)
                variable = await loop.add_variable(node, role, 0.0, ua.VariantType.Double)
                units = ua.EUInformation(DisplayName=ua.LocalizedText(unit))
                await variable.add_property(index, "EngineeringUnits", units)
                await variable.add_property(index, "EURange", ua.Range(Low=0.0, High=high))
                self.nodes[f"FIC-{101 + k}.{role}"] = node
        await server.start()
        for node in self.nodes.values():
            await server.historize_node_data_change(server.get_node(node))
        for rows in self.kept.values():  # the values that nodes begin with are not of the plant
            rows[:] = [one for one in rows if one.SourceTimestamp is not None and one.Value.Value != 0.0]
        self._record_requests()

    async def _refuse_history(self, *_: object) -> ua.HistoryReadResult:
        if self.refuse_history == "service":
            raise ServiceError(ua.StatusCodes.BadServiceUnsupported)
        return ua.HistoryReadResult(StatusCode=ua.StatusCode(ua.StatusCodes.BadHistoryOperationUnsupported))

    def _record_requests(self) -> None:
        plain = UaProcessor._process_message
        if getattr(plain, "is_recording", False):
            plain.lists.append((self.port, self.requests))
            return
        lists = [(self.port, self.requests)]

        async def record(processor, typeid, *rest):
            name = ua.ObjectIdNames.get(typeid.Identifier, str(typeid))
            for _, requests in lists:
                requests.append(name.removesuffix("_Encoding_DefaultBinary"))
            return await plain(processor, typeid, *rest)

        record.is_recording, record.lists = True, lists
        UaProcessor._process_message = record


class _Users:
    def __init__(self, users: dict[str, str]) -> None:
        self.users = users

    def get_user(self, iserver, username=None, password=None, certificate=None):
        from asyncua.crypto.permission_rules import User, UserRole

        if username in self.users and self.users[username] == password:
            return User(role=UserRole.User)
        return None


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]

"""A subscription to variables of an OPC UA server that loses no value between two messages of the server."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.errors import import_extra
from stiction.sources.historians.chunks import chunks

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from asyncua.client.client import Client

__all__ = ["LOST_VALUES", "missing_nodes", "subscribe"]

ITEMS_PER_CALL = 500
"""Variables that are subscribed to with one call [-]."""
SPARE_TIME = 20.0
"""Time that a queue holds, in intervals of publishing [-]: the network may be gone for so long."""
MIN_QUEUE = 10
"""Least length of a queue [-]."""
LOST_VALUES = 0x480
"""Bits of a status code by which a server says that a full queue lost older values (OPC UA Part 4, 7.39.1)."""


async def subscribe(
    client: Client,
    nodes: Sequence[str],
    take: Callable[[int, Any], None],
    *,
    publishing_s: float = 1.0,
    sampling_s: float = 0.0,
) -> dict[str, str]:
    """Subscribe to variables.

    Parameters
    ----------
    client : Client
        A connected client.
    nodes : sequence of str
        Node ids.
    take : callable
        Called with the number of the node, from 0, and its DataValue, in the order of the server.
    publishing_s : float
        Interval of the messages of the server [s].
    sampling_s : float
        Interval at which the server looks at a variable [s]; 0: as fast as the server can.

    Returns
    -------
    dict
        Node ids that the server refuses -> why.
    """
    ua = import_extra("asyncua.ua", "live")
    base = import_extra("asyncua.common.subscription", "live").Subscription

    class DirectSubscription(base):
        """Hands values on as they come, without the queue of asyncua, which drops the oldest."""

        async def publish_callback(self, publish_result: Any) -> None:
            for data in publish_result.NotificationMessage.NotificationData or ():
                for item in getattr(data, "MonitoredItems", ()):
                    take(item.ClientHandle, item.Value)

    asked = ua.CreateSubscriptionParameters(
        RequestedPublishingInterval=1000.0 * publishing_s, RequestedLifetimeCount=600, RequestedMaxKeepAliveCount=10,
        MaxNotificationsPerPublish=0, PublishingEnabled=True, Priority=0,
    )  # fmt: skip
    subscription = DirectSubscription(client.uaclient.session, asked)
    await subscription.init()
    # a constant set point with new times counts as alive
    trigger = ua.DataChangeFilter(Trigger=ua.DataChangeTrigger.StatusValueTimestamp)
    queue = max(MIN_QUEUE, round(SPARE_TIME * publishing_s / max(sampling_s, 0.05)))
    refused: dict[str, str] = {}
    for chunk in chunks(enumerate(nodes), ITEMS_PER_CALL):
        requests = [
            ua.MonitoredItemCreateRequest(
                ItemToMonitor=ua.ReadValueId(NodeId=ua.NodeId.from_string(node), AttributeId=ua.AttributeIds.Value),
                MonitoringMode=ua.MonitoringMode.Reporting,
                RequestedParameters=ua.MonitoringParameters(
                    ClientHandle=number, SamplingInterval=1000.0 * sampling_s, Filter=trigger, QueueSize=queue,
                    DiscardOldest=True,
                ),
            )
            for number, node in chunk
        ]  # fmt: skip
        results = await subscription.create_monitored_items(requests)
        refused |= {node: one.name for (_, node), one in zip(chunk, results, strict=True) if hasattr(one, "name")}
    return refused


async def missing_nodes(client: Client, nodes: Sequence[str]) -> dict[str, str]:
    """Variables that the server does not have, or no longer has -> its status code."""
    ua = import_extra("asyncua.ua", "live")
    missing: dict[str, str] = {}
    for chunk in chunks(nodes, ITEMS_PER_CALL):
        read = [client.get_node(node) for node in chunk]
        results = await client.read_attributes(read, ua.AttributeIds.NodeClass)
        for node, one in zip(chunk, results, strict=True):
            if one.StatusCode is not None and not one.StatusCode.is_good():
                missing[node] = one.StatusCode.name
    return missing

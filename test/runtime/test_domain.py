"""Runs on one machine never meet."""

from nao_lipm_gait.ros.domain import DomainClaim


def test_two_runs_never_get_the_same_domain():
    with DomainClaim() as first, DomainClaim() as second:
        assert first.domain != second.domain
        environment = second.environment()
        assert environment["ROS_DOMAIN_ID"] == str(second.domain)
        assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"

    with DomainClaim() as again:
        assert again.domain != second.domain, "its late messages may still be under way"
